"""The page of a map in a browser: it draws, tells what is pointed at, and the legend switches classes off."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

import laserimg as package
from command import laserimg

STREET = Path(package.__file__).parent / "demo" / "street.npz"
BROWSER = next(
    (path for name in ("chromium", "chrome", "google-chrome") if (path := shutil.which(name))), None
)
OPTIONS = (
    "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--window-size=900,600", "--virtual-time-budget=4000", "--dump-dom",
)  # fmt: skip

# Looks at the largest car from the scanner, points at its middle, switches cars off, and points again.
ACT = """<script>setTimeout(() => {
  setTurning(false);
  const car = map.named.find(k => map.clusters[k].class === "car"), at = map.clusters[car].at;
  Object.assign(camera, { target: at.slice(), distance: 6, yaw: Math.atan2(-at[1], -at[0]), pitch: 0.3 });
  draw();
  const point = () => { view.dispatchEvent(new PointerEvent("pointermove",
    { clientX: innerWidth / 2, clientY: innerHeight / 2, pointerType: "mouse" })); draw();
    return document.getElementById("card").hidden ? "" : document.querySelector("#card h2").textContent; };
  const told = { before: point(), facts: document.getElementById("card").textContent };
  [...document.querySelectorAll("#classes label")].find(row => row.textContent.startsWith("car"))
    .querySelector("input").click();
  draw();
  told.after = point();
  const pre = document.createElement("pre");
  Object.assign(pre, { id: "told", textContent: JSON.stringify(told) });
  document.body.append(pre);
}, 1000)</script></body>"""


@pytest.mark.long
@pytest.mark.skipif(BROWSER is None, reason="needs a Chromium")
def test_the_page_tells_what_is_pointed_at(tmp_path):
    assert laserimg("map", STREET, "-o", tmp_path, "--quiet").code == 0
    page = (tmp_path / "map.html").read_text(encoding="utf-8").replace("</body>", ACT)
    (tmp_path / "acting.html").write_text(page, encoding="utf-8")
    command = [BROWSER, *OPTIONS, (tmp_path / "acting.html").as_uri()]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=300, check=True).stdout
    (told,) = re.findall(r'<pre id="told">(.*?)</pre>', dom)
    told = json.loads(told)
    assert re.fullmatch(r"car [01]\.\d\d", told["before"])
    assert re.search(r"size\d\.\d\d x \d\.\d\d m, \d\.\d\d m highstandson the ground", told["facts"])
    assert "car rather than" in told["facts"]
    assert not told["after"].startswith("car")
