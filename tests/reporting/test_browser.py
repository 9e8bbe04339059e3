"""report.html in a real browser: headless Chromium, driven through a pipe by its DevTools protocol."""

import fcntl
import json
import os
import select
import shutil
import subprocess

import pytest

SWITCHES = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-dev-shm-usage --remote-debugging-pipe"
).split()
PATIENCE = 120.0
"""Seconds to wait for an answer, on a loaded machine."""

LIGHT, DARK = "light", "dark"

LOOK = """(() => {
  const seen = (one) => { const box = one.getBoundingClientRect(); return box.width > 0 && box.height > 0; };
  const words = document.body.innerText.split(/\\s+/).length;
  document.querySelectorAll("details").forEach((one) => { one.open = true; });
  const pictures = [...document.images];
  return {
    words: words,
    width: innerWidth,
    page_width: document.documentElement.scrollWidth,
    headline: document.querySelector(".verdict .headline").innerText,
    headline_bottom: document.querySelector(".verdict .headline").getBoundingClientRect().bottom,
    tables: [...document.querySelectorAll("table")].filter(seen).map((one) => one.innerText),
    pictures: pictures.map((one) => [one.alt, one.complete ? one.naturalWidth : 0, one.width]),
    hidden: pictures.filter((one) => !seen(one)).length,
    lost: [...document.querySelectorAll("nav a")].filter((one) => !document.querySelector(one.hash)).length,
    ink: getComputedStyle(document.querySelector(".headline")).color,
    paper: getComputedStyle(document.querySelector("section")).backgroundColor,
  };
})()"""


class Browser:
    """One tab of Chromium; every request that its pages make is kept in `requests`."""

    def __init__(self, command, profile):
        (orders, self.told), (self.heard, answers) = os.pipe(), os.pipe()
        # In the browser the ends of the pipes must be 3 and 4, so here they must be others.
        ends = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in (orders, answers)]
        place = f'exec "$@" 3<&{ends[0]} 4>&{ends[1]}'
        words = ["bash", "-c", place, "bash", command, *SWITCHES, f"--user-data-dir={profile}"]
        quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
        self.process = subprocess.Popen(words, pass_fds=ends, **quiet)
        for end in (orders, answers, *ends):
            os.close(end)
        self.rest, self.count, self.session, self.requests = b"", 0, None, []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Network", "Runtime"):
            self.ask(f"{domain}.enable")

    def ask(self, method, **params):
        self.count += 1
        message = {"id": self.count, "method": method, "params": params}
        if self.session is not None:
            message["sessionId"] = self.session
        os.write(self.told, json.dumps(message).encode() + b"\0")
        answer = self.read_until(lambda one: one.get("id") == self.count)
        assert "error" not in answer, answer
        return answer["result"]

    def read_until(self, wanted):
        while True:
            while b"\0" not in self.rest:
                assert select.select([self.heard], [], [], PATIENCE)[0], "Chromium does not answer."
                part = os.read(self.heard, 1 << 16)
                assert part, "Chromium has ended."
                self.rest += part
            line, _, self.rest = self.rest.partition(b"\0")
            message = json.loads(line)
            if message.get("method") == "Network.requestWillBeSent":
                self.requests.append(message["params"]["request"]["url"])
            if wanted(message):
                return message

    def open(self, path, width, scheme=LIGHT):
        self.requests.clear()
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.ask("Page.navigate", url=path.as_uri())
        self.read_until(lambda one: one.get("method") == "Page.loadEventFired")

    def look(self):
        return self.ask("Runtime.evaluate", expression=LOOK, returnByValue=True)["result"]["value"]

    def close(self):
        os.close(self.told)  # Chromium ends with its pipe
        self.process.wait(timeout=PATIENCE)
        os.close(self.heard)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    command = shutil.which("chromium")
    if command is None:
        if os.environ.get("CI") == "true":
            pytest.fail("CI needs Chromium: apt-get install chromium")
        pytest.skip("no Chromium here")
    opened = Browser(command, tmp_path_factory.mktemp("chromium"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def report(request, demo_beside):
    """That of the demo, which .ci/run makes where nothing else is installed; else a smaller one."""
    if demo_beside is not None:
        return demo_beside / "report.html"
    return request.getfixturevalue("written") / "report.html"


def outside(requests):
    return [address for address in requests if not address.startswith(("data:image/png;base64,", "file:"))]


def luminance(colour):
    """Relative luminance of "rgb(r, g, b)" by WCAG 2.2."""
    shares = [int(part) / 255.0 for part in colour[4:-1].split(",")]
    linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
    return sum(weight * share for weight, share in zip((0.2126, 0.7152, 0.0722), linear, strict=True))


@pytest.mark.parametrize("scheme", [LIGHT, DARK])
@pytest.mark.parametrize("width", [1280, 400])
def test_browser_shows_headline_tables_and_every_picture_and_asks_nothing_of_the_network(
    browser, report, width, scheme
):
    browser.open(report, width, scheme)
    seen = browser.look()
    assert seen["width"] == width
    assert seen["page_width"] <= width, "the page is wider than the screen"
    assert "friction" in seen["headline"]
    assert seen["words"] <= 900
    assert seen["headline_bottom"] < 900, "the headline is not on the first screen"
    assert any("NRMSE" in table and "held out" in table for table in seen["tables"])
    assert len(seen["pictures"]) >= 16
    assert [name for name, own, _ in seen["pictures"] if not own] == []
    assert seen["hidden"] == seen["lost"] == 0
    leads = seen["pictures"][:3]
    assert [name for name, _, _ in leads][::2] == ["residual over the cycle", "cross-correlation"]
    assert all(shown >= 300 for _, _, shown in leads)
    light, dark = sorted((luminance(seen["ink"]), luminance(seen["paper"])), reverse=True)
    assert (light + 0.05) / (dark + 0.05) > 7.0
    assert (luminance(seen["paper"]) > 0.5) == (scheme == LIGHT)
    assert outside(browser.requests) == []


def test_a_request_to_the_network_would_be_seen(browser, tmp_path):
    page = tmp_path / "page.html"
    page.write_text('<h1>asks</h1><img src="http://localhost:9/picture.png">', encoding="utf-8")
    browser.open(page, 1280)
    assert outside(browser.requests) == ["http://localhost:9/picture.png"]
