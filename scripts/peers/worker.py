"""One tool on one problem and mesh, in a process of its own: processor time of its solves, as JSON.

    python -m peers.worker asset P3 '["LGL7", 8]' 2

First, then so many times more. What the tool imports is loaded before; building the problem and solving it is
timed, the first time with whatever the tool loads only then.
"""

import importlib
import json
import sys
import time


def main() -> None:
    tool, name, mesh, again = sys.argv[1:]
    by, tasks = importlib.import_module(f"peers.by_{tool}"), importlib.import_module("peers.tasks")
    seconds = []
    for _ in range(1 + int(again)):
        begun = time.process_time()
        answer = by.solve(tasks.TASKS[name], *json.loads(mesh))
        seconds.append(time.process_time() - begun)
    print(json.dumps({"seconds": seconds, "answer": answer.plain()}))


if __name__ == "__main__":
    main()
