"""Starts `lerobot-excav demos` again and again from one process that has loaded the libraries.

A line on standard input holds arguments as JSON: options of the command, a file that gets a line for every episode that
this process begins to play, and a file for what the command prints. Answers: the process group, then the exit code.
"""

import json
import os
import sys
from importlib import import_module
from pathlib import Path


def run(options, played, log):
    from lerobot_excav.datasets.record import simulation
    from lerobot_excav.scripts.main import main

    for stream in (1, 2):
        os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
    play = simulation.play_demonstration

    def counted(settings, pair):
        with Path(played).open("a", encoding="utf-8") as file:
            file.write(f"{pair.uid}\n")
        return play(settings, pair)

    simulation.play_demonstration = counted  # workers are processes of their own, and do not count
    return main(["demos", *options])


def serve():
    for name in ("toy_reach.env", "lerobot_excav.datasets.record.assembly", "lerobot_excav.scripts.demos"):
        import_module(name)
    for line in sys.stdin:
        child = os.fork()
        os.setpgid(child, child)  # in both: whichever comes first
        if not child:
            code = 70
            try:
                code = run(*json.loads(line))
            finally:
                sys.stdout.flush()
                os._exit(code)
        print(child, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)


if __name__ == "__main__":
    serve()
