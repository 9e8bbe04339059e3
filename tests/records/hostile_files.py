"""Data files that should be refused, or read in spite of what stands beside the wanted channels."""

import struct
from pathlib import Path

import h5py
import numpy as np
import pyarrow
import scipy.io
from hostile_declarations import Case
from hostile_writers import (
    SAMPLES,
    VALUE,
    archive_of,
    blank,
    deleted,
    door,
    file,
    h5,
    linked,
    linked_to,
    lvm,
    many_members,
    mat_four,
    mat_zeros,
    npy,
    npz,
    ods,
    outside,
    parquet,
    parts,
    pipe,
    put,
    sheet,
    some_chunks,
    sparse,
    tdms,
    tdms_of,
    to_itself,
    two_names,
    uff,
    unknown_filter,
    virtual,
    zeros,
)
from test_corpus import array_element, element, mat, packed

TOO_MUCH = r"to read it takes \S+ (GiB of memory|s); expected at most"
BROKEN = "cannot be read as"
ENDINGS = (".csv", ".lvm", ".xlsx", ".ods", ".parquet", ".npz", ".mat", ".h5", ".uff", ".tdms")
RIGHT = ("right",)

CASES: dict[str, Case] = {}
for ending in ENDINGS:
    CASES |= {
        f"a pipe{ending}": file(ending, pipe, "is a pipe; expected one file on a disk"),
        f"a device{ending}": file(ending, lambda path: path.symlink_to("/dev/zero"), "is a device; expected"),
        f"an empty file{ending}": file(ending, put(b""), r"is empty \(0 bytes\); expected"),
        f"gigabytes of nothing{ending}": file(ending, blank, f"{TOO_MUCH}|{BROKEN}", None),
    }
CASES |= {
    "a socket": file(".csv", door, "is a socket; expected"),
    "a folder": file(".csv", Path.mkdir, "is a folder; expected"),
    "a link to a right file": file(".h5", linked_to, None, ("run/force",)),
    "a link to itself": file(".csv", to_itself, "does not exist"),
    "gigabytes behind a right .mat": file("_73.mat", sparse, None),
    "gigabytes behind a right .h5": file(".h5", sparse, None, ("run/force",)),
    "gigabytes behind a right .uff": file(".uff", sparse, TOO_MUCH),
    "gigabytes behind a right .tdms": file(".tdms", sparse, f"{TOO_MUCH}|{BROKEN}"),
}
# Tables of text.
CASES |= {
    "80 million lines": file(".csv", put(b"\n" * 80_000_000), TOO_MUCH),
    "20 million lines": file(".csv", put(b"force\n" + b"\n" * 20_000_000), "no rows of numbers"),
    "60 million cells": file(".csv", put(b"force,a\n" + b"1,2\n" * 15_000_000), TOO_MUCH),
    "a letter of four bytes": file(
        ".csv", put("force,🔥\n".encode() + b"1.234567,2.345678\n" * 1_000_000), None
    ),
    "cells of text": file(".csv", put(b"force,a\n" + b"1,ab\n" * 3_000_000), None),
    "cells of text that are asked for": file(".csv", put(b"a,force\n" + b"1,ab\n" * 20_000_000), TOO_MUCH),
    "a heading of spaces": file(".csv", put(b"force,a" + b" " * 60_000 + b"b [N\n" + b"1,2\n" * 20), None),
    "a heading of brackets": file(".csv", put(b"force," + b"[" * 60_000 + b"\n" + b"1,2\n" * 20), None),
    "1,025 separators": file(".csv", put(b"force,a\n1,2" + b"," * 1025 + b"\n1,2" * 20), "has 1027 columns"),
    "numbers of 60,000 digits": file(
        ".csv", put(b"force,a\n" + b"9" * 60_000 + b",2\n" + b"1,2\n" * 20), None
    ),
    "exponents without end": file(".csv", put(b"force,a\n" + b"1e999999999,2\n" * 20), None),
    "quotation marks": file(
        ".csv", put(b"force,a\n" + b'"' * 60_000 + b"\n" + b"1,2\n" * 20), "no column `force`"
    ),
    "half a text of UTF-16": file(".csv", put("force,a\n1,2\n".encode("utf-16")[:-1]), "cannot|`force`|rows"),
}
# Archives.
CASES |= {
    "2 GB of zeros in 2 MB": file(".npz", archive_of("force.npy", npy((2**31,), "|u1"), 128), TOO_MUCH),
    "256 MB of them": file(".npz", archive_of("force.npy", npy((2**28,), "|u1"), 16), TOO_MUCH),
    "32 MB of them": file(".npz", archive_of("force.npy", npy((2**25,), "|u1"), 2), None),
    "2 GB that are no array": file(".npz", archive_of("force", b"", 128), TOO_MUCH),
    "2 GB beside": file(".npz", archive_of("other.npy", npy((2**31,), "|u1"), 128), "has no column `force`"),
    "30,000 members": file(".npz", many_members, TOO_MUCH + "|more than 16384"),
    "a negative shape": file(".npz", npz(force=npy((-5,)) + bytes(400)), "array `force` cannot be read"),
    "a shape of 1,000 sides": file(".npz", npz(force=npy((1,) * 1000) + bytes(8)), "array `force` cannot be"),
    "a shape beyond numbers": file(".npz", npz(force=npy((10**40,))), TOO_MUCH),
    "a header of brackets": file(
        ".npz", npz(force=b"\x93NUMPY\1\0" + struct.pack("<H", 9000) + b"(" * 9000), "array `force` cannot"
    ),
    "a type of nothing": file(".npz", npz(force=npy((50,), "V0")), "column `force`|array `force`"),
    "a pickle": file(
        ".npz", npz(force=npy((1,), "|O") + b"cos\nsystem\n(S'true'\ntR."), "array `force` cannot"
    ),
    "a pickle alone": file(".npz", put(b"cos\nsystem\n(S'true'\ntR."), BROKEN),
    "a directory that lies": file(".npz", put(b"PK\5\6" + bytes(8) + b"\xff" * 8 + bytes(2)), TOO_MUCH),
}
# Spreadsheets.
CASES |= {
    "rows repeated": file(
        ".ods",
        ods(
            f'<table:table-row table:number-rows-repeated="1048576"><table:table-cell {VALUE} '
            'table:number-columns-repeated="16384"/></table:table-row>'
        ),
        TOO_MUCH,
    ),
    "empty rows repeated": file(
        ".ods",
        ods(
            f"<table:table-row><table:table-cell {VALUE}/></table:table-row>"
            '<table:table-row table:number-rows-repeated="1048575"><table:table-cell '
            'table:number-columns-repeated="16384"/></table:table-row>'
        ),
        "holds no table|no column `force`|`force`",
    ),
    "a text repeated": file(
        ".ods",
        ods(
            '<table:table-row table:number-rows-repeated="100000">'
            '<table:table-cell office:value-type="string">'
            f"<text:p>{'x' * 100_000}</text:p></table:table-cell></table:table-row>"
        ),
        TOO_MUCH,
    ),
    "a stray cell": file(
        ".xlsx",
        sheet('<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'),
        TOO_MUCH + r".* reaches to row 1048576 and column 16384; .* cause: a stray entry",
    ),
    "one long text in each cell": file(
        ".xlsx", sheet("<row>" + '<c t="s"><v>0</v></c>' * 50_000 + "</row>"), TOO_MUCH
    ),
    "gigabytes of XML": file(
        ".xlsx", archive_of("xl/worksheets/sheet1.xml", b"<a", 128, 32), "has a text of more than"
    ),
    "XML within XML": file(
        ".xlsx",
        parts(
            ".xlsx",
            (
                "xl/worksheets/sheet1.xml",
                '<!DOCTYPE a [<!ENTITY a "aaaaaaaaaa">'
                + "".join(
                    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
                )
                + "]><worksheet><sheetData><row><c><v>&j;</v></c></row></sheetData></worksheet>",
            ),
        ),
        f"{BROKEN}|holds no table",
    ),
    "tags within tags": file(
        ".xlsx", parts(".xlsx", ("xl/worksheets/sheet1.xml", "<a>" * 300_000)), f"{BROKEN}|holds no table"
    ),
    "a part of nothing": file(".xlsx", parts(".xlsx", ("xl/workbook.xml", "")), f"{BROKEN}|holds no table"),
    "30,000 parts": file(".xlsx", many_members, TOO_MUCH + "|more than 16384"),
    "16,000 parts": file(
        ".xlsx", parts(".xlsx", *((f"a{i}.xml", "<c/>") for i in range(16_000))), "has no column `x`", ("x",)
    ),
}
# Parquet.
CASES |= {
    "runs of 48 million": file(
        ".parquet", parquet(lambda: pyarrow.table({"force": np.zeros(3_000_000)}), 16), TOO_MUCH
    ),
    "runs beside": file(
        ".parquet",
        parquet(
            lambda: pyarrow.table(
                {"force": np.zeros(10_000), **{f"a{i}": np.zeros(10_000) for i in range(900)}}
            ),
            10,
        ),
        None,
    ),
    "lists in lists": file(".parquet", parquet(lambda: pyarrow.table({"force": [[[1.0]]] * 50})), "list<"),
    "structures": file(".parquet", parquet(lambda: pyarrow.table({"force": [{"a": 1.0}] * 50})), "struct<"),
    "texts": file(
        ".parquet", parquet(lambda: pyarrow.table({"force": ["x" * 9] * 50})), "holds string values"
    ),
    "nothing": file(
        ".parquet", parquet(lambda: pyarrow.table({"force": pyarrow.nulls(50)})), "holds null values"
    ),
    "long texts beside": file(
        ".parquet",
        parquet(
            lambda: pyarrow.table(
                {"force": SAMPLES, "b": pyarrow.array(["x" * 100_000] * 50).dictionary_encode()}
            ),
            100,
        ),
        None,
    ),
    "two of a name": file(
        ".parquet",
        parquet(lambda: pyarrow.Table.from_arrays([pyarrow.array(SAMPLES)] * 2, ["force", "force"])),
        "2 channels",
    ),
}
# MATLAB.
CASES |= {
    "2 GB of numbers": file(".mat", mat_zeros(6, 9), TOO_MUCH),
    "2 GB of bytes that are numbers": file(".mat", mat_zeros(6, 2), TOO_MUCH),
    "2 GB of letters": file(".mat", mat_zeros(4, 2), TOO_MUCH),
    "2 GB in a cell": file(".mat", mat_zeros(1, 2), TOO_MUCH),
    "2 GB beside": file(".mat", mat_zeros(6, 9), "has no column `other`; it has `force`", ("other",)),
    "rows below zero": file(".mat", lambda path: mat(path, array_element(-5, 40)), f"{TOO_MUCH}|{BROKEN}"),
    "elements of nothing": file(
        ".mat",
        lambda path: mat(path, element(14, element(6, struct.pack("<II", 2, 0)) + bytes(8) * 400_000)),
        f"more than 16384|{BROKEN}|has no column",
    ),
    "an element packed twice": file(
        ".mat", lambda path: mat(path, packed(packed(bytes(64)))), f"{BROKEN}|has no"
    ),
    "version 4 of a billion": file(".mat", mat_four(10**9), BROKEN),
    "version 4 below zero": file(".mat", mat_four(-1), f"{BROKEN}|column `force`"),
    "a sparse matrix": file(
        ".mat", lambda path: scipy.io.savemat(path, {"force": scipy.sparse.eye(50)}), "column `force`"
    ),
}
# HDF5.
CASES |= {
    "zeros": file(".h5", h5(zeros), TOO_MUCH),
    "zeros of eight bytes": file(".h5", h5(lambda one: zeros(one, "f8")), TOO_MUCH),
    "zeros beside": file(".h5", h5(zeros), None, RIGHT),
    "a link into a pipe": file(".h5", h5(linked), "`force` is a link into the file pipe.h5; expected"),
    "a link into a pipe beside": file(".h5", h5(linked), None, RIGHT),
    "a link into a pipe, all asked for": file(".h5", h5(linked), None, None),
    "storage in a pipe": file(".h5", h5(outside), "`force` is stored outside the file"),
    "storage in a pipe beside": file(".h5", h5(outside), None, RIGHT),
    "a part in a pipe": file(".h5", h5(virtual("pipe.h5")), "pipe.h5 is a pipe"),
    "a part that is gone": file(".h5", h5(virtual("gone.h5")), "is made of the file gone.h5, which does not"),
    "a part that is gone, beside": file(".h5", h5(virtual("gone.h5")), None, RIGHT),
    "a part of the file itself": file(".h5", h5(virtual(".", "/right")), None),
    "a part too short": file(".h5", h5(virtual(".", "/right", 40)), "has 10 samples that come from nowhere"),
    "a part that it is itself": file(".h5", h5(virtual(".", "/force")), "more than 64 levels deep"),
    "a part without a name": file(".h5", h5(virtual(".", "/none")), "lacks its part `/none`"),
    "chunks never written": file(
        ".h5", h5(lambda one: one.create_dataset("force", (50,), "f8", chunks=(10,))), "were never written"
    ),
    "some chunks never written": file(".h5", h5(some_chunks), "has samples that were never written"),
    "some chunks never written, beside": file(".h5", h5(some_chunks), None, RIGHT),
    "numbers never written": file(
        ".h5", h5(lambda one: one.create_dataset("force", (50,), "f8")), "were never"
    ),
    "texts beside": file(
        ".h5",
        h5(lambda one: one.update(force=["a", "bc"]) or one.create_dataset("t", data=["a"])),
        None,
        RIGHT,
    ),
    "texts": file(".h5", h5(lambda one: one.create_dataset("force", data=["a", "b"])), "holds text or lists"),
    "texts, all asked for": file(".h5", h5(lambda one: one.create_dataset("t", data=["a", "b"])), None, None),
    "lists of different length beside": file(
        ".h5", h5(lambda one: one.create_dataset("t", (5,), h5py.vlen_dtype("f8"))), None, RIGHT
    ),
    "a chunk of gigabytes": file(
        ".h5",
        h5(
            lambda one: one.create_dataset(
                "force", (10,), "f8", chunks=(2**28,), maxshape=(None,), compression=9
            )
        ),
        f"{TOO_MUCH}|never written",
    ),
    "names of each other": file(".h5", h5(two_names), None, RIGHT),
    "16,500 groups": file(
        ".h5",
        h5(lambda one: [one.create_group(str(i)) for i in range(16_500)]),
        "more than 16384 groups",
        RIGHT,
    ),
    "a filter that nobody has": file(".h5", h5(unknown_filter), f"{BROKEN}|column `force`"),
    "a filter that nobody has, beside": file(".h5", h5(unknown_filter), None, RIGHT),
    "a link to nothing": file(".h5", h5(lambda one: one.update(force=h5py.SoftLink("/no"))), "has no column"),
    "nothing in a dataset": file(".h5", h5(lambda one: one.update(force=h5py.Empty("f8"))), "column `force`"),
    "a unit that is an array": file(
        ".h5", h5(lambda one: one["right"].attrs.update(unit=np.ones(5))), None, RIGHT
    ),
    "references to what was deleted, beside": file(".h5", h5(deleted), None, RIGHT),
    "a class that is no text, beside": file(
        ".h5", h5(lambda one: one["right"].attrs.update(MATLAB_class=np.bytes_(b"\xff\xfe"))), None, RIGHT
    ),
    "references to what is gone": file(
        ".h5", h5(lambda one: one.create_dataset("force", (50,), h5py.ref_dtype)), "has no column `force`"
    ),
}
# Lists of channels.
CASES |= {
    f"an increment of {value}": file(".tdms", tdms(wf_increment=value), said)
    for value, said in (
        (float("nan"), None),
        (0.0, None),
        (-1.0, None),
        (float("inf"), "rate of 0"),
        (1e-320, "rate of inf"),
        (1e-300, "rate of 1e.300"),
    )
}
CASES |= {
    "a start of nan": file(
        ".tdms", tdms(wf_increment=0.01, wf_start_offset=float("nan")), "start time of nan"
    ),
    "an increment in words": file(".tdms", tdms(wf_increment="fast"), BROKEN),
    "300,000 segments": file(".tdms", tdms(300_000), TOO_MUCH),
    "10,000 segments": file(".tdms", tdms(10_000), None),
    "a segment of 1e17 numbers": file(".tdms", tdms_of(10**17), f"{TOO_MUCH}|{BROKEN}"),
    "a segment of 1e9 numbers": file(".tdms", tdms_of(10**9), None),
    "a header of LabVIEW and lines": file(".lvm", lvm(more="\n" * 3_000_000), TOO_MUCH),
    "a billion channels": file(".lvm", lvm("Channels\t2", "Channels\t1000000000"), None),
    "channels of brackets": file(".lvm", lvm("Channels\t2", "Channels\t" + "(" * 60_000), BROKEN),
    "channels to a power": file(".lvm", lvm("Channels\t2", "Channels\t9**9**9"), BROKEN),
    "one row of 30,000 cells": file(
        ".lvm", lvm("Channels\t2", "Channels\t99999", more="1\t" * 30_000 + "\n" + "1\n" * 100_000), TOO_MUCH
    ),
    "a step of 1e-320": file(".lvm", lvm("Delta_X\t0.005\t0.005", "Delta_X\t1e-320\t1e-320"), "rate of inf"),
    "a step of 1e300": file(".lvm", lvm("Delta_X\t0.005\t0.005", "Delta_X\t1e300\t1e300"), "rate of 1e-300"),
    "lines of a universal file": file(".uff", put(b"    -1\n" * 300_000), f"{TOO_MUCH}|more than 16384"),
    "nothing but lines": file(".uff", put(b"\n" * 20_000_000), TOO_MUCH),
    "a step of nan": file(".uff", uff("1.00000e+00  0.00", "        nan  0.00"), "time step of nan|rate"),
    "a step of 1e-310": file(".uff", uff(" 1.00000e+00  0.00", " 1.0000e-310  0.00"), "rate of inf"),
    "an abscissa of words": file(".uff", uff("0.00000e+00  1.00000e+00", "       zero  1.00000e+00"), BROKEN),
    "a billion points announced": file(
        ".uff", uff("        50         1", "1000000000         1"), "announces 1"
    ),
}
