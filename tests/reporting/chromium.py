"""Headless Chromium, driven through a pipe by its DevTools protocol."""

import fcntl
import json
import os
import select
import subprocess

SWITCHES = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking "
    "--disable-component-update --disable-sync --disable-dev-shm-usage --remote-debugging-pipe"
).split()
PATIENCE = 120.0
"""Seconds to wait for an answer, on a loaded machine."""


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

    def open(self, path, width, scheme="light"):
        self.requests.clear()
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self.ask("Emulation.setDeviceMetricsOverride", **size)
        self.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        self.ask("Page.navigate", url=path.as_uri())
        self.read_until(lambda one: one.get("method") == "Page.loadEventFired")

    def value(self, expression):
        """Gives what a JavaScript expression is on the page."""
        return self.ask("Runtime.evaluate", expression=expression, returnByValue=True)["result"]["value"]

    def close(self):
        os.close(self.told)  # Chromium ends with its pipe
        self.process.wait(timeout=PATIENCE)
        os.close(self.heard)
