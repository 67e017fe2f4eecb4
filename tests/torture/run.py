"""Random scenes over the whole public interface, in processes of their own: ``python -m tests.torture.run``.

Each scene is a pure function of its seed, so that ``--only SEED`` examines one again, and ``--only dSEED`` a comparison
of a derivative with differences, ``--only fSEED`` one in a scene of distance fields, ``--only gSEED`` one of gloss,
``--only xSEED`` one with features of real scenes.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.torture.processes import results
from tests.torture.summary import Summary

# Seconds between lines of progress.
PROGRESS = 30.0


def tasks(args: argparse.Namespace, until: float) -> Iterator[str]:
    """Scenes by their seeds, and comparisons (a letter and the seed) among them, until the time is up."""
    if args.only is not None:
        yield args.only
        return
    shares = {"d": args.differences, "f": args.fields, "g": args.gloss, "x": args.features}
    due = dict.fromkeys(shares, 0.0)
    for seed in range(args.seed, args.seed + args.count):
        if time.monotonic() > until:
            return
        yield str(seed)
        for kind, share in shares.items():
            due[kind] += share
            if due[kind] >= 1.0:
                due[kind] -= 1.0
                yield f"{kind}{args.seed + int((seed - args.seed) * share)}"


def finished(log: Path) -> list[dict[str, Any]]:
    """The results in a log. A line without an end was being written when its run was stopped."""
    if not log.exists():
        return []
    lines = log.read_text().splitlines(keepends=True)
    return [json.loads(line) for line in lines if line.endswith("\n")]


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.torture.run", description=__doc__)
    parser.add_argument("--count", type=int, default=5000, help="scenes")
    parser.add_argument("--seed", type=int, default=0, help="the first scene's seed")
    parser.add_argument("--differences", type=float, default=0.0,
                        help="comparisons of derivatives with differences, as a share of the scenes")
    parser.add_argument("--fields", type=float, default=0.0,
                        help="the same in scenes of distance fields among mirrors, glass, meshes and other fields")
    parser.add_argument("--gloss", type=float, default=0.0, help="the same in scenes of several glossy surfaces")
    parser.add_argument("--features", type=float, default=0.0,
                        help="the same in plain scenes with bent normals, linked lights, copies and the like")
    parser.add_argument("--only", help="examine the scene of this seed (dSEED, fSEED, gSEED, xSEED: comparison) alone")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--minutes", type=float, default=1e6, help="begin no scene after this time")
    parser.add_argument("--timeout", type=float, default=60.0, help="seconds after which a scene counts as hanging")
    parser.add_argument("--log", type=Path, help="file that gets a line of JSON for each scene")
    parser.add_argument("--continued", action="store_true", help="keep the results of --log, and do what it lacks")
    args = parser.parse_args()
    if args.continued and args.log is None:
        parser.error("--continued needs --log")
    start = time.monotonic()
    summary, last = Summary(), start
    kept = finished(args.log) if args.continued else []
    for found in kept:
        summary.add(found)
    log = args.log.open("w") if args.log is not None else None
    if log is not None:
        log.writelines(json.dumps(found) + "\n" for found in kept)
        log.flush()
    done = {found["task"] for found in kept}
    try:
        left = (task for task in tasks(args, start + 60.0 * args.minutes) if task not in done)
        for found in results(left, args.workers, args.timeout):
            summary.add(found)
            if log is not None:
                log.write(json.dumps(found) + "\n")
                log.flush()
            _report(found, args.only is not None)
            if time.monotonic() - last > PROGRESS:
                last = time.monotonic()
                rate = (summary.count - len(kept)) / (last - start)
                print(f"{summary.count} scenes, {rate:.1f} a second, {summary.failed} with "
                      "findings", flush=True)  # fmt: skip
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
    finally:
        if log is not None:
            log.close()
    seconds = time.monotonic() - start
    rate = (summary.count - len(kept)) / seconds
    print(f"\n{summary}\n{summary.count} scenes, {len(kept)} of them from an earlier run")
    print(f"{seconds:.0f} s, {rate:.1f} scenes a second")
    return 1 if summary.failed or not summary.count else 0


def _report(found: dict[str, Any], everything: bool) -> None:
    for check, words in found["wrong"].items():
        print(f"seed {found['task']}: {check}: {words}", flush=True)
    if everything:
        print(json.dumps(found, indent=1))


if __name__ == "__main__":
    sys.exit(main())
