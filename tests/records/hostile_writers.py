"""Writers of hostile data files: pipes, bombs, and headers that lie."""

import functools
import os
import socket
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from pathlib import Path

import h5py
import nptdms
import numpy as np
import pyarrow
import pyarrow.parquet
from hostile_declarations import Case
from test_corpus import element, header, mat
from test_damaged_files import WRITERS
from test_file_formats import write_universal

from isojax.records.reading import READERS

TOO_MUCH, ABSENT = r"to read it takes \S+ GiB of memory; expected at most 1", "has no column"
SAMPLES = np.arange(50.0)
Write = Callable[[Path], object]


def file(ending: str, write: Write, said: str | None, names: Sequence[str] | None = ("force",)) -> Case:
    """A data file and the columns that are asked for; None for all."""

    def put(folder: Path) -> Callable[[], object]:
        path = folder / f"run{ending}"
        write(path)
        return lambda: READERS[path.suffix](path, names)

    return put, said


@functools.cache
def block(value: int) -> bytes:
    """Packs 16 MB of one byte, so that blocks may follow each other."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(bytes([value]) * 2**24) + packer.flush(zlib.Z_FULL_FLUSH)


def deflated(first: bytes, blocks: int, value: int = 0) -> bytes:
    """Packs some bytes as they are, and so many blocks after them."""
    stored = b"\x00" + struct.pack("<HH", len(first), 0xFFFF ^ len(first)) + first
    return stored + block(value) * blocks + zlib.compressobj(9, zlib.DEFLATED, -15).flush()


def archive_of(member: str, first: bytes, blocks: int, value: int = 0) -> Write:
    """An archive with one member: some bytes, and so many blocks of one byte after them."""

    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr(member, deflated(first, blocks, value))
        raw, size = bytearray(path.read_bytes()), len(first) + blocks * 2**24
        check = zlib.crc32(bytes([value]) * 2**24 * min(blocks, 2), zlib.crc32(first))
        for at, mark in ((raw.index(b"PK\3\4"), 8), (raw.rindex(b"PK\1\2"), 10)):
            raw[at + mark : at + mark + 2] = struct.pack("<H", 8)
            raw[at + mark + 6 : at + mark + 10] = struct.pack("<I", check)
            raw[at + mark + 14 : at + mark + 18] = struct.pack("<I", size)
        path.write_bytes(raw)

    return write


def npy(shape: tuple[int, ...], descr: str = "<f8") -> bytes:
    return header(shape).replace(b"'<f8'", repr(descr).encode())


def npz(**members: bytes) -> Write:
    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in members.items():
                archive.writestr(f"{name}.npy", content)

    return write


def many_members(path: Path) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        for i in range(30_000):
            archive.writestr(f"a{i}.npy", b"")


def parts(ending: str, *written: tuple[str, bytes | str]) -> Write:
    """A spreadsheet of which some parts are replaced."""

    def write(path: Path) -> None:
        WRITERS[ending](path)
        with zipfile.ZipFile(path) as archive:
            held = {one.filename: archive.read(one) for one in archive.infolist()}
        for name, content in written:
            old = held.get(name, b"")
            new = content.encode() if isinstance(content, str) else content
            held[name] = new.replace(b"{old}", old)
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in held.items():
                archive.writestr(name, content)

    return write


def sheet(rows: str) -> Write:
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    return parts(
        ".xlsx",
        ("xl/worksheets/sheet1.xml", f'<worksheet xmlns="{main}"><sheetData>{rows}</sheetData></worksheet>'),
        ("xl/sharedStrings.xml", f'<sst xmlns="{main}"><si><t>{"x" * 30_000}</t></si></sst>'),
    )


def ods(rows: str) -> Write:
    spaces = " ".join(
        f'xmlns:{one}="urn:oasis:names:tc:opendocument:xmlns:{one}:1.0"' for one in NAMES_OF_ODS
    )
    table = f'<office:spreadsheet><table:table table:name="run">{rows}</table:table></office:spreadsheet>'
    content = (
        f"<office:document-content {spaces}><office:body>{table}</office:body></office:document-content>"
    )
    return parts(".ods", ("content.xml", content))


NAMES_OF_ODS = ("office", "table", "text")
VALUE = 'office:value-type="float" office:value="1"'


def h5(fill: Callable[[h5py.File], object]) -> Write:
    """An HDF5 file with right channels under `right`, and something else."""

    def write(path: Path) -> None:
        with h5py.File(path, "w") as handle:
            handle["right"] = SAMPLES
            fill(handle)

    return write


def zeros(handle: h5py.File, dtype: str = "u1") -> None:
    node = handle.create_dataset("force", (2**31,), dtype, chunks=(2**24,), compression="gzip")
    block = zlib.compress(bytes(2**24 * node.dtype.itemsize), 9)
    for i in range(128):
        node.id.write_direct_chunk((i * 2**24,), block)


def outside(handle: h5py.File) -> None:
    pipe = Path(handle.filename).with_name("pipe.bin")
    os.mkfifo(pipe)
    handle.create_dataset("force", (50,), "f8", external=[(str(pipe), 0, h5py.h5f.UNLIMITED)])


def linked(handle: h5py.File) -> None:
    pipe = Path(handle.filename).with_name("pipe.h5")
    os.mkfifo(pipe)
    handle["force"] = h5py.ExternalLink(pipe.name, "/force")


def virtual(source: str, name: str = "/x", size: int = 50) -> Callable[[h5py.File], object]:
    def fill(handle: h5py.File) -> None:
        layout = h5py.VirtualLayout((50,), "f8")
        layout[:size] = h5py.VirtualSource(source, name, (size,))
        if source == "pipe.h5":
            os.mkfifo(Path(handle.filename).with_name(source))
        handle.create_virtual_dataset("force", layout)

    return fill


def some_chunks(handle: h5py.File) -> None:
    handle.create_dataset("force", (50,), "f8", chunks=(10,))[:20] = 1.0


def two_names(handle: h5py.File) -> None:
    handle["a"] = handle["b"] = handle.create_group("c")
    handle["c/d"] = handle["c/e"] = handle["/"]


def deleted(handle: h5py.File) -> None:
    handle["gone"] = SAMPLES
    handle["force"] = np.array([handle["gone"].ref], h5py.ref_dtype)
    del handle["gone"]


def unknown_filter(handle: h5py.File) -> None:
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((50,))
    plist.set_filter(32_999, h5py.h5z.FLAG_OPTIONAL)
    space = h5py.h5s.create_simple((50,))
    node = h5py.h5d.create(handle.id, b"force", h5py.h5t.NATIVE_DOUBLE, space, plist)
    node.write_direct_chunk((0,), bytes(400))


def parquet(table: Callable[[], pyarrow.Table], groups: int = 1) -> Write:
    def write(path: Path) -> None:
        held = table()
        with pyarrow.parquet.ParquetWriter(path, held.schema) as writer:
            for _ in range(groups):
                writer.write_table(held)

    return write


def mat_zeros(kind: int, storage: int) -> Write:
    """A packed MAT variable of 2 GB of zeros, with a class and a type in which it is stored."""

    def write(path: Path) -> None:
        size = 120 * 2**24
        shape = element(5, struct.pack("<ii", size // (8 if storage == 9 else 1), 1))
        inner = element(6, struct.pack("<II", kind, 0)) + shape + element(1, b"force")
        inner += struct.pack("<II", storage, size)
        stored = b"\x78\x9c" + deflated(struct.pack("<II", 14, len(inner) + size) + inner, 120) + bytes(4)
        mat(path, struct.pack("<II", 15, len(stored)) + stored)

    return write


def mat_four(rows: int) -> Write:
    return lambda path: path.write_bytes(
        struct.pack("<5i", 0, rows, 1, 0, 6) + b"force\0" + SAMPLES.tobytes()
    )


def tdms(times: int = 1, **properties: object) -> Write:
    def write(path: Path) -> None:
        with nptdms.TdmsWriter(str(path)) as writer:
            writer.write_segment([nptdms.ChannelObject("g", "force", SAMPLES, properties=properties)])
        path.write_bytes(path.read_bytes() * times)

    return write


def tdms_of(length: int) -> Write:
    """A segment that announces so many numbers, and holds fifty."""

    def write(path: Path) -> None:
        tdms()(path)
        path.write_bytes(path.read_bytes().replace(struct.pack("<Q", 50), struct.pack("<Q", length)))

    return write


def lvm(old: str = "", new: str = "", more: str = "") -> Write:
    def write(path: Path) -> None:
        WRITERS[".lvm"](path)
        path.write_text(path.read_text().replace(old, new) + more if old else path.read_text() + more)

    return write


def uff(old: str = "", new: str = "") -> Write:
    def write(path: Path) -> None:
        write_universal(path, {"time": SAMPLES, "force": SAMPLES})
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new) if old else text)

    return write


def pipe(path: Path) -> None:
    os.mkfifo(path)


def door(path: Path) -> None:
    """A socket."""
    with socket.socket(socket.AF_UNIX) as one:
        one.bind(str(path))


def to_itself(path: Path) -> None:
    path.symlink_to(path)


def linked_to(path: Path) -> None:
    """A right file that stands elsewhere."""
    WRITERS[path.suffix](path.with_stem("elsewhere"))
    path.symlink_to(path.with_stem("elsewhere"))


def sparse(path: Path) -> None:
    """Three gigabytes of zeros that take no place on the disk, behind a right file."""
    WRITERS["_73.mat" if path.suffix == ".mat" else path.suffix](path)
    os.truncate(path, 3 * 2**30)


def blank(path: Path) -> None:
    path.touch()
    os.truncate(path, 3 * 2**30)


def put(content: bytes) -> Write:
    return lambda path: path.write_bytes(content)
