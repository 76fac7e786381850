#!/usr/bin/env python3
"""What a look at a tenth of a second costs with the `mcap` reader of the MCAP project: processor time and memory.

    python3 tools/oracles/seek.py runs/.../walk.mcap

Opens the file anew at five places, all topics. Nobody else should use the machine meanwhile.
"""

import sys
import time
import tracemalloc

import environment

WINDOW_S = 0.1
PLACES = (0.02, 0.25, 0.5, 0.75, 0.98)


def look(path, at_s):
    from mcap.reader import make_reader

    window = {"starting_at": int(1e9 * at_s), "ending_before": int(1e9 * (at_s + WINDOW_S))}
    with open(path, "rb") as file:
        return sum(1 for _ in make_reader(file).iter_messages(**window))


def main(path):
    from mcap.reader import make_reader

    with open(path, "rb") as file:
        summary = make_reader(file).get_summary()
    end_s = 1e-9 * summary.statistics.message_end_time
    print(f"{end_s:.0f} s, {len(summary.chunk_indexes)} chunks")
    for place in PLACES:
        look(path, place * end_s)
        before = time.process_time()
        messages = look(path, place * end_s)
        spent_s = time.process_time() - before
        tracemalloc.start()
        look(path, place * end_s)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        print(f"at {place * end_s:5.0f} s: {messages} messages, {spent_s:.3f} s of processor, {peak / 1e6:.1f} MB")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: seek.py FILE.mcap")
    environment.enter(environment.HERE / ".venv-recording", environment.HERE / "requirements-recording.txt")
    main(sys.argv[1])
