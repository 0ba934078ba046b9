"""One tool on one problem and mesh, in a process of its own: processor time of its solves, as JSON.

    python -m peers.worker asset P3 '["LGL7", 8]' 2

First, then so many times more, or once if solves take long. What the tool imports is loaded before; building
the problem and solving it is timed, the first time with whatever the tool loads only then. What turns its
answer into the terms that all share is not.
"""

import importlib
import json
import sys
import time

# No more solves begin once those before took this long together [s].
BRIEF = 0.5


def main() -> None:
    tool, name, mesh, again = sys.argv[1:]
    by, tasks = importlib.import_module(f"peers.by_{tool}"), importlib.import_module("peers.tasks")
    seconds = []
    while len(seconds) < 2 or (len(seconds) <= int(again) and sum(seconds) < BRIEF):
        begun = time.process_time()
        found = by.solve(tasks.TASKS[name], *json.loads(mesh))
        seconds.append(time.process_time() - begun)
    print(json.dumps({"seconds": seconds, "answer": found().plain()}))


if __name__ == "__main__":
    main()
