"""Replay the scripted operator through the console's page, in a browser, and count its successes.

Every cycle of `val` is played twice from the same start: by the operator itself, and by a gamepad in headless Chromium
that holds the operator's sticks for the frame that the page shows. Finished cycles are kept in FILE, and the same
command goes on after an interruption. Run it from the repository's root, with nothing else at work.

Examples:
  python -m validation.page_operator
      25 scenes with 4 targets each (40 minutes)
  python -m validation.page_operator --scenes=1 --file=outputs/page.jsonl
      a quick look
"""

import argparse
import json
import shutil
import sys
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

from lerobot_excav.envs.tasks.scoop.spec import SCOOP
from validation.finished_plays import read_finished
from validation.page_operator.pad import STUBBED_PAD, Plan, planned
from validation.page_operator.socket_page import ConsoleProcess, SocketPage
from validation.rate_words import rate_words

FILE = Path("results", "scoop", "page_operator.jsonl")
SCENE_SET = "val"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def play(page: Any, onlooker: SocketPage, plan: Plan, *, scene_id: int, target_id: int) -> dict[str, Any]:
    """Play a cycle through the page, from choosing the scene on; return its outcome as data."""
    page.evaluate("window.plan = null")
    page.locator("#start input[name=scene_id]").fill(str(scene_id))
    page.locator("#start button").click()
    onlooker.wait(lambda state: state["scene"]["scene_id"] == scene_id and state["frame"] == 0 and not state["over"])
    overlay = page.locator("#overlay")
    box = overlay.bounding_box()
    place = next(t for t in onlooker.state["targets"] if t["number"] == target_id)
    overlay.click(position={"x": place["x"] * box["width"], "y": place["y"] * box["height"]})
    # The target may be the one of the start; what is clicked before the console has answered is not heard.
    onlooker.wait(lambda state: state["target"] == target_id and "is commanded" in state["words"] and state["ready"])
    page.locator("#drive").click()
    losses = hold_sticks(page, onlooker, plan)
    state = onlooker.state
    return {
        "simulation_version": SCOOP.simulation_version,
        "scene_id": scene_id,
        "target_id": target_id,
        "is_success": bool(state["over"] and state["success"]),
        "is_success_without_page": plan.is_success,
        "frames": state["frame"],
        "frames_without_page": len(plan.sticks),
        "speed": state["speed"],
        "measured": state["measured"],
        "delay": page.locator("#delay").inner_text(),
        "losses": losses,
    }


def hold_sticks(page: Any, onlooker: SocketPage, plan: Plan) -> int:
    """Hold the planned sticks until the cycle is over, or twice its time; return how often they were lost.

    Where the page was not heard for too long, sticks count only once they were let go: a person does it, and goes on.
    """
    losses, frames = 0, 2 * len(plan.sticks)

    def is_over(state: dict[str, Any]) -> bool:
        return bool(state["over"] or state["frame"] >= frames)

    while not is_over(onlooker.state):
        page.evaluate("plan => { window.plan = plan; }", plan.sticks)
        onlooker.wait(lambda state: is_over(state) or not state["ready"], limit_s=300.0)
        if not is_over(onlooker.state):
            losses += 1
            page.evaluate("window.plan = null")
            onlooker.wait(lambda state: is_over(state) or state["ready"])
    return losses


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(
        "python -m validation.page_operator",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--scenes", type=int, default=25, help="scenes, with 4 cycles each (default: 25)")
    parser.add_argument("--file", type=Path, default=FILE, help=f"finished cycles (default: {FILE})")
    given = parser.parse_args(arguments)
    if given.scenes < 1:
        parser.error(f"--scenes={given.scenes}; allowed: 1 and above")
    wanted = [(scene, target) for scene in range(given.scenes) for target in range(SCOOP.target_count)]
    given.file.parent.mkdir(parents=True, exist_ok=True)
    done = {(cycle["scene_id"], cycle["target_id"]) for cycle in read_finished(given.file)}
    missing = [pair for pair in wanted if pair not in done]
    if missing:
        _play_all(missing, given.file)
    cycles = [cycle for cycle in read_finished(given.file) if (cycle["scene_id"], cycle["target_id"]) in wanted]
    print("\n".join(summary(cycles)))
    return 0


def _play_all(missing: list[tuple[int, int]], path: Path) -> None:
    from playwright.sync_api import sync_playwright

    executable = next(filter(None, map(shutil.which, BROWSERS)), None)
    env = SCOOP.make_env(obs_type="agent_pos", render_mode=None, scene_set=SCENE_SET)
    flags = ("--env.type=excavator", f"--env.scene_set={SCENE_SET}")
    with closing(env), ConsoleProcess(*flags) as console, sync_playwright() as playwright:
        onlooker = SocketPage(console.address, drives=False)
        page = playwright.chromium.launch(executable_path=executable, args=["--no-sandbox"]).new_page()
        page.add_init_script(STUBBED_PAD)
        page.goto(console.address)
        page.get_by_text("you have the controls").wait_for()
        for scene_id, target_id in missing:
            plan = planned(env, scene_id=scene_id, target_id=target_id)
            cycle = play(page, onlooker, plan, scene_id=scene_id, target_id=target_id)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(cycle) + "\n")
            words = "success" if cycle["is_success"] else "failed"
            print(f"scene {scene_id}, target {target_id}: {words}; {cycle['delay']}", flush=True)


def summary(cycles: Sequence[dict[str, Any]]) -> list[str]:
    """Return what came of the cycles, as lines."""
    lines = []
    for words, key in (("without the page", "is_success_without_page"), ("through the page", "is_success")):
        lines.append(f"{words}: {rate_words(sum(cycle[key] for cycle in cycles), len(cycles))}")
    lost = [(c["scene_id"], c["target_id"]) for c in cycles if c["is_success_without_page"] and not c["is_success"]]
    lines.append(f"lost through the page: {lost or 'none'}")
    interrupted = sum(cycle.get("losses", 0) > 0 for cycle in cycles)
    lines.append(f"cycles in which the page was not heard for a while: {interrupted}")
    return lines


if __name__ == "__main__":
    sys.exit(main())
