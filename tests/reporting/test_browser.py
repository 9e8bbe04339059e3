"""report.html in a real browser."""

import pytest

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
    seen = browser.value(LOOK)
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
