"""Kill `isojax close-loop` with SIGKILL at random moments, resume it, and compare the results.

Run `python benchmarks/kill_and_resume.py [--kills 20] [--seed 0] [--campaign FOLDER]`; without a campaign,
two records of the demo, cut after their second dwells. The command runs once undisturbed. Then it is started
again and again with `--resume` and killed after a time that is uniform over that of the undisturbed run; one
that ends before is compared and begun anew. Printed for each kill: when, how much was kept, the last line
of progress. The exit status is 1 if a result.json differs by a digit of anything but its times, or if an
output of isojax stood in the folder after a kill.
"""

import argparse
import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np


def cut_demo(folder: Path, dwells: int | None = None) -> Path:
    """Give the records of the demo at 150 N, whole or up to the end of their first dwells."""
    from isojax.demo import campaign_folder

    shutil.copytree(campaign_folder(), folder)
    head, *records = (folder / "campaign.toml").read_text(encoding="utf-8").split("[[record]]")
    kept = "[[record]]".join([head, *(text for text in records if "150N" in text)])
    (folder / "campaign.toml").write_text(kept, encoding="utf-8")
    for schedule in folder.glob("*150N*.csv") if dwells else ():
        rows = schedule.read_text(encoding="utf-8").splitlines()
        stop = round(float(rows[dwells + 1].split(",")[0]) * 500.0)
        schedule.write_text("\n".join(rows[: dwells + 1]) + "\n", encoding="utf-8")
        data = schedule.with_name(schedule.name.replace("_schedule.csv", ".npz"))
        with np.load(data) as arrays:
            shorter = {name: arrays[name][:stop] for name in arrays}
        np.savez(data, **shorter)
    return folder


def start(campaign: Path, out: Path, log: Path) -> subprocess.Popen:
    """Start the command; its words go to a file."""
    words = [sys.executable, "-m", "isojax", "close-loop", str(campaign), "--out", str(out), "--resume"]
    with log.open("wb") as said:
        return subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=said)


def result(out: Path) -> dict:
    """Give result.json without its times."""
    content = json.loads((out / "result.json").read_text(encoding="utf-8"))
    del content["seconds"]
    return content


def main() -> int:
    """Kill, resume, compare."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--campaign", type=Path)
    asked = parser.parse_args()
    moments, failures, compared = random.Random(asked.seed), 0, 0
    with tempfile.TemporaryDirectory() as work:
        folder, log = Path(work), Path(work) / "log"
        os.environ.setdefault("ISOJAX_CACHE", str(folder / "cache"))
        campaign = asked.campaign or cut_demo(folder / "campaign", dwells=2)
        seconds = 0.0
        for _ in range(2):  # the first run fills the cache of compiled code
            shutil.rmtree(folder / "whole", ignore_errors=True)
            begin = time.perf_counter()
            if start(campaign, folder / "whole", log).wait() not in (0, 1):
                print(log.read_text(encoding="utf-8"))
                return 1
            seconds = time.perf_counter() - begin
        expected = result(folder / "whole")
        print(f"undisturbed: {seconds:.1f} s, verdict {expected['verdict']}", flush=True)
        out, kills = folder / "killed", 0
        while kills < asked.kills or (out / ".isojax" / "answers").exists():
            last = kills == asked.kills
            run = start(campaign, out, log)
            wait = None if last else moments.uniform(0.0, seconds)
            try:
                code = run.wait(wait)
            except subprocess.TimeoutExpired:
                run.kill()
                run.wait()
                kills += 1
                lines = log.read_text(encoding="utf-8").splitlines()
                stage = lines[-1] if lines else "nothing"
                kept = out / ".isojax" / "answers"
                size = kept.stat().st_size if kept.exists() else 0
                left = [] if not out.exists() else [p.name for p in out.iterdir() if p.name != ".isojax"]
                failures += bool(left)
                print(
                    f"kill {kills:2d} at {wait:5.1f} s: {size:8d} bytes kept; {stage[:70]} {left or ''}",
                    flush=True,
                )
                continue
            said = log.read_text(encoding="utf-8")
            same = code in (0, 1) and result(out) == expected
            failures += not same
            compared += 1
            print(f"ended with code {code}: {'the same digits' if same else 'DIFFERS: ' + said}", flush=True)
            shutil.rmtree(out, ignore_errors=True)
    print(f"{kills} kills, {compared} ends compared, {failures} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
