"""Test of the 3D view: kinematics against the formulas, and dragging a hand and a tip."""

import base64
import math
import random
import tomllib
from pathlib import Path

from playwright.sync_api import expect

# Centre of the pixels of a colour in a picture, as a fraction of its size.
CENTRE = """async ([source, hue]) => {
    const image = new Image();
    image.src = source;
    await image.decode();
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    let [count, x, y] = [0, 0, 0];
    for (let i = 0; i < data.length; i += 4) {
        const [r, g, b] = data.slice(i, i + 3);
        const largest = Math.max(r, g, b), least = Math.min(r, g, b);
        if (largest - least < 40) continue;
        const angle = 60 * (largest === r ? ((g - b) / (largest - least) + 6) % 6
            : largest === g ? (b - r) / (largest - least) + 2 : (r - g) / (largest - least) + 4);
        if (Math.abs(angle - hue) > 12) continue;
        [count, x, y] = [count + 1, x + (i / 4) % image.width, y + Math.floor(i / 4 / image.width)];
    }
    return count < 20 ? null : [x / count / image.width, y / count / image.height];
}"""
HAND_HUE, REFERENCE_HUE = 22, 38


def rotation(axis, angle):
    c, s = math.cos(angle), math.sin(angle)
    return [[1, 0, 0], [0, c, -s], [0, s, c]] if axis == "x" else [[c, -s, 0], [s, c, 0], [0, 0, 1]]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(matrix, vector):
    return [sum(value * vector[k] for k, value in enumerate(row)) for row in matrix]


def tip_of_arm(arm, positions):
    """Craig, Introduction to Robotics, chapter 3."""
    turn, origin = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 0, 0]
    for link, position in zip(arm["link"], positions):
        bent = product(turn, rotation("x", link.get("alpha_rad", 0)))
        origin = [a + b for a, b in zip(origin, apply(turn, [link.get("a_m", 0), 0, 0]))]
        origin = [a + b for a, b in zip(origin, apply(bent, [0, 0, link.get("d_m", 0)]))]
        turn = product(bent, rotation("z", link.get("theta_rad", 0) + position))
    return [a + b for a, b in zip(origin, apply(turn, arm["tip_m"]))]


def tip_of_phantom(base, inner, outer):
    """Cavusoglu, Feygin, Tendick, Presence 11(6), 2002, with x forward, y left, z up."""
    reach = 0.215 * math.cos(inner) + 0.170 * math.sin(outer)
    return [reach * math.cos(base), reach * math.sin(base), 0.215 * math.sin(inner) - 0.170 * math.cos(outer)]


def computed(page, geometry, positions, body, point):
    return page.evaluate("""async ([geometry, positions, body, own]) => {
        const { mechanism, point } = await import("/kinematics.js");
        return point(mechanism(geometry).poses(positions)[body], own);
    }""", [geometry, positions, body, point])


def near(one, other, tolerance=1e-9):
    assert all(abs(a - b) < tolerance for a, b in zip(one, other)), (one, other)


def kinematics(page):
    arm = tomllib.loads((Path(__file__).parents[3] / "scenarios/arm.toml").read_text())["device"][0]["arm"]
    filled = {"link": [{"a_m": 0, "alpha_rad": 0, "d_m": 0, "theta_rad": 0, **link} for link in arm["link"]], "tip_m": arm["tip_m"]}
    linkage = {"inner_m": 0.215, "outer_m": 0.170}
    chance = random.Random(1)
    start = tip_of_phantom(0, 0, 0)
    for _ in range(20):
        angles = [chance.uniform(-2, 2) for _ in range(6)]
        near(computed(page, {"arm": filled}, angles, 6, arm["tip_m"]), tip_of_arm(arm, angles))
        angles = [chance.uniform(-1, 1), chance.uniform(-0.4, 0.8), chance.uniform(-0.3, 0.4)]
        tip = tip_of_phantom(*angles)
        joint = {"phantom": {"port": "joint", "linkage": linkage, "start_position_rad": [0, 0, 0]}}
        near(computed(page, joint, angles, 2, [0, 0, -0.170]), tip)
        # Of the tip's position, the same pose.
        cartesian = {"phantom": {**joint["phantom"], "port": "cartesian"}}
        relative = [value - origin for value, origin in zip(tip, start)]
        near(computed(page, cartesian, relative, 2, [0, 0, -0.170]), tip)
        near(computed(page, cartesian, relative, 1, [0.215, 0, 0]), computed(page, joint, angles, 1, [0.215, 0, 0]))
    # A reachable target is reached.
    goal = tip_of_arm(arm, [0.3, -0.5, 0.4, 0.1, 0.2, 0])
    found = page.evaluate("""async ([geometry, target]) => {
        const { mechanism, follow } = await import("/kinematics.js"), kind = mechanism(geometry);
        return follow(kind, [0, 0, 0, 0, 0, 0], kind.tips[0].axes, kind.tips[0], target);
    }""", [{"arm": filled}, goal])
    near(tip_of_arm(arm, found), goal, 2e-3)


def centre(page, hue):
    """Place of a coloured part of the view, in px of the page."""
    view = page.locator("#robot canvas")
    picture = base64.b64encode(view.screenshot()).decode()
    found = page.evaluate(CENTRE, [f"data:image/png;base64,{picture}", hue])
    assert found, f"no part with hue {hue} in the 3D view"
    box = view.bounding_box()
    return box["x"] + found[0] * box["width"], box["y"] + found[1] * box["height"]


def position(page, axis=0):
    """Measured position of an axis, as its dial shows it."""
    return float(page.locator("#device [role=slider]").nth(axis).locator("text").first.text_content().split()[0])


def drag(page, hue, dx, dy):
    x, y = centre(page, hue)
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=8)


def opened(browser, url, errors):
    page = browser.new_page(viewport={"width": 1440, "height": 1000}, color_scheme="light")
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(url)
    page.wait_for_selector("#robot canvas")
    page.wait_for_selector("#device [role=slider]")
    page.wait_for_function("() => document.querySelector('#device text').textContent !== '–'")
    return page


def hand(browser, url, step, errors):
    step("telerobot: master and slave side by side; a dragged hand moves the master and returns")
    page = opened(browser, url, errors)
    kinematics(page)
    expect(page.locator("#robot .labels span")).to_have_text(["master", "slave"])
    assert abs(position(page)) < 0.01
    drag(page, HAND_HUE, -60, 15)
    page.wait_for_function("() => Math.abs(parseFloat(document.querySelector('#device text').textContent)) > 0.02", timeout=60000)
    page.mouse.up()
    page.wait_for_function("() => Math.abs(parseFloat(document.querySelector('#device text').textContent)) < 0.01", timeout=60000)
    page.close()


def tip(browser, url, step, errors, folder):
    step("arm: a dragged tip moves all joints; the arrow keys turn the view")
    page = opened(browser, url, errors)
    page.click("#arm")
    page.wait_for_selector(".verdict.good", timeout=60000)
    # The experiment's moves end after 2.2 s; the reference of the tip is then visible.
    page.wait_for_function("() => Math.abs(parseFloat(document.querySelectorAll('#device [role=slider]')[1].querySelector('text').textContent)) > 0.79", timeout=60000)
    before = [position(page, axis) for axis in range(3)]
    page.locator("#robot").screenshot(path=folder / "robot.png")
    drag(page, REFERENCE_HUE, 30, -40)
    page.wait_for_function("""(before) => [...document.querySelectorAll('#device [role=slider]')].slice(0, 3).filter((slider, axis) =>
        Math.abs(parseFloat(slider.querySelector('text').textContent) - before[axis]) > 0.02).length >= 2""", arg=before, timeout=60000)
    page.mouse.up()
    page.focus("#robot canvas")
    first = page.locator("#robot canvas").screenshot()
    for _ in range(4):
        page.keyboard.press("ArrowLeft")
    page.wait_for_timeout(300)
    assert page.locator("#robot canvas").screenshot() != first
    page.close()


def pictures(browser, url, folder):
    """Pictures for README: the arm in motion, light and dark."""
    for scheme, name in (("light", "page.png"), ("dark", "page-dark.png")):
        page = browser.new_page(viewport={"width": 1440, "height": 1120}, color_scheme=scheme)
        page.goto(url)
        page.wait_for_selector("#robot canvas")
        page.wait_for_selector("#plots figure canvas")
        page.click("#arm")
        page.wait_for_selector(".verdict.good", timeout=60000)
        page.wait_for_function("() => Math.abs(parseFloat(document.querySelectorAll('#device [role=slider]')[1].querySelector('text').textContent)) > 0.5", timeout=60000)
        page.evaluate("() => { document.querySelector('#toast').hidden = true; }")
        page.screenshot(path=folder / name)
        page.click("#disarm")
        page.close()
