"""The console's page in a real browser: the system's own Chromium, without a window."""

import os
import shutil
import threading
from contextlib import contextmanager
from types import SimpleNamespace

import pytest

from lerobot_excav.console import opening
from lerobot_excav.datasets.record.demonstration_settings import DemonstrationSettings
from lerobot_excav.page import sticks
from lerobot_excav.page.access import Access, free_port
from validation.page_operator.pad import STUBBED_PAD

NAMES = ("chromium", "chromium-browser", "google-chrome")


def executable():
    return next(filter(None, map(shutil.which, NAMES)), None)


@pytest.fixture(scope="session")
def browser():
    """Chromium; where the environment says that it has to be there, its absence is an error."""
    path = executable()
    if path is None:
        assert os.environ.get("EXCAV_BROWSER_TESTS") != "required", f"none of {', '.join(NAMES)} is installed"
        pytest.skip(f"none of {', '.join(NAMES)} is installed; on Debian: apt-get install chromium")
    from playwright.sync_api import expect, sync_playwright

    expect.set_options(timeout=20_000)  # two cores with other tests on them

    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield launched
        launched.close()


@pytest.fixture
def patience(monkeypatch):
    """Let a machine that is busy with other tests be silent for long: the page counts as heard all the same."""
    monkeypatch.setattr(sticks, "LOST_S", 30.0)


@pytest.fixture
def open_page(browser):
    """Open a console's page in a browser of its own; what it complains about fails the test."""
    contexts, faults = [], []

    def _open(served, *, pad=False, path=None, **options):
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
        contexts.append(context)
        page = context.new_page()
        if pad:
            page.add_init_script(STUBBED_PAD)
        # Once the console has ended, the page looks for it in vain.
        page.on("pageerror", lambda error: served.is_over or faults.append(str(error)))
        page.on("console", lambda message: message.type != "error" or served.is_over or faults.append(message.text))
        page.set_default_timeout(30_000)
        page.goto(path or served.address)
        return page

    _open.faults = faults
    yield _open
    for context in contexts:
        context.close()
    assert faults == []


@contextmanager
def serving(env_type="excavator", *, env=None, out=None, policy=None, speed=1.0, **schedule):
    """Serve a console in a thread of its own while the block runs."""
    fast = {"fidelity": "fast"} if env_type == "excavator" else {}
    settings = DemonstrationSettings.of(
        env_type, {**fast, **(env or {})}, keep_failures=True, **{"scenes": 1, **schedule}
    )
    access = Access(host="127.0.0.1", port=free_port("127.0.0.1"))
    served, ready, over = SimpleNamespace(error=None, is_over=False), threading.Event(), threading.Event()

    def serve():
        try:
            with opening.open_console(
                settings, access=access, size=(480, 640), speed=speed, policy=policy, out=out
            ) as opened:
                served.console, served.address = opened.console, opened.address
                ready.set()
                opened.console.run(over.is_set)
        except BaseException as error:
            served.error = error
            ready.set()

    thread = threading.Thread(target=serve, daemon=True)
    thread.start()
    assert ready.wait(timeout=300.0)
    try:
        if served.error is None:
            yield served
    finally:
        served.is_over = True
        over.set()
        thread.join(timeout=30.0)
        if served.error is not None:
            raise served.error
