"""Test of the page in a real browser, step by step. Run by `cargo xtask step page`.

usage: page.py DIMSART FOLDER    the command, and the folder for pictures
"""

import atexit
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import expect, sync_playwright

import access
import editor
import layout
import robot
import scope
import tuning

DIMSART, FOLDER = sys.argv[1], Path(sys.argv[2])
FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync"]
PORT = 8471
RECORDINGS = tempfile.mkdtemp()


class Server:
    """`dimsart serve`, or `dimsart view` of recordings, killed at the end."""

    def __init__(self, rig="joint", files=()):
        command = [DIMSART, "serve", rig, "--page-port", str(PORT), "--recordings", RECORDINGS]
        if files:
            command = [DIMSART, "view", *files, "--page-port", str(PORT)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        atexit.register(self.kill)
        for line in self.process.stdout:
            found = re.search(r"http://\S+", line)
            if found:
                self.url = found.group()
                return
        raise SystemExit("the server said no address")

    def kill(self):
        self.process.kill()
        self.process.wait()


def connect(*words):
    subprocess.run([DIMSART, "connect", "sim:joint", *words], check=True, stdout=subprocess.DEVNULL)


def step(text):
    print(f"  {text}", flush=True)


def drawn(page):
    """Number of pixels of curves in the first plot: axes and texts are grey."""
    script = """() => { const c = document.querySelector('#plots canvas'); const d = c.getContext('2d')
        .getImageData(0, 0, c.width, c.height).data; let n = 0;
        for (let i = 0; i < d.length; i += 4) n += d[i + 3] > 0 && Math.abs(d[i] - d[i + 2]) > 80; return n }"""
    return page.evaluate(script)


def wait_for_plot(page):
    """Waits until the plot is drawn: on a busy machine the first samples arrive late."""
    for _ in range(60):
        if drawn(page) > 50:
            return
        page.wait_for_timeout(250)
    raise AssertionError("nothing is drawn")


def arm(page):
    """Arms the controller; on a busy machine the lease can be lost before it is shown."""
    for _ in range(5):
        page.click("#arm")
        try:
            return expect(page.locator("#state-text")).to_contain_text("commands the device")
        except AssertionError:
            page.wait_for_timeout(500)
    raise AssertionError("it cannot be armed")


def shown_tick(page):
    script = """() => parseInt([...document.querySelectorAll('#facts dt')]
        .find((name) => name.textContent === 'tick')?.nextSibling.textContent)"""
    return page.evaluate(script)


def csv(page):
    """Returns the shown signals as CSV."""
    with page.expect_download() as download:
        page.click("#export")
    return Path(download.value.path()).read_text()


def short_ring(route):
    """The page with a scope of two seconds."""
    answer = route.fetch()
    assert "SECONDS = 60" in answer.text(), "the length of the ring is not found"
    route.fulfill(response=answer, body=answer.text().replace("SECONDS = 60", "SECONDS = 2"))


def held_picture(browser, url, errors):
    step("a held picture is unchanged when its ring continues")
    page = browser.new_page(viewport={"width": 1500, "height": 1000}, color_scheme="light")
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.route("**/ring.js", short_ring)
    page.goto(url)
    page.wait_for_selector(".module")
    page.select_option("#window", "1")
    page.wait_for_function("() => document.querySelector('#plots canvas')")
    start = shown_tick(page)
    while shown_tick(page) < start + 1500:
        page.wait_for_timeout(100)
    page.click("#run")
    held, tick = csv(page), shown_tick(page)
    assert len(held.splitlines()) > 100, "too few rows are held"
    while shown_tick(page) < tick + 4000:
        page.wait_for_timeout(100)
    page.select_option("#view", "xy")
    page.select_option("#view", "time")
    assert csv(page) == held, "the held picture has changed"
    assert drawn(page) > 50, "the held picture is not drawn"
    page.click("#run")
    assert csv(page) != held, "the picture does not continue"

    step("missing ticks and a restart are gaps, wrapped ticks are not")
    found = page.evaluate("""async () => {
        const { Ring } = await import('/ring.js');
        const ring = new Ring({ number: 1, every_ticks: 2, signals: [{ name: 'A', unit: '', words: 1 }] }, 0.001);
        const row = new DataView(new ArrayBuffer(4));
        for (const tick of [4294967292, 4294967294, 0, 2, 10, 12, 0]) ring.push(tick, row, 0);
        const rows = [...Array(ring.count).keys()];
        return [rows.map((one) => ring.time(one)), rows.map((one) => ring.follows(one)), ring.gaps];
    }""")
    assert found == [[0, 2, 4, 6, 14, 16, 20], [False, True, True, True, False, True, False], 3], found
    page.close()


def two_pages(browser, page, url, errors):
    step("of two pages, the armed one shows it, and the other one cannot change anything")
    other = browser.new_page(viewport={"width": 1500, "height": 1000}, color_scheme="light")
    other.on("pageerror", lambda error: errors.append(str(error)))
    other.goto(url)
    other.wait_for_selector(".module")
    gain = other.get_by_label("PIDCTRL_MOD K_PARAM")
    expect(gain).to_be_enabled()
    arm(page)
    expect(page.locator("#arm")).to_have_text("Armed by this page")
    expect(page.locator("#disarm")).to_be_enabled()
    expect(other.locator("#arm")).to_have_text("Armed by another page")
    for id in ["#arm", "#disarm", "#reset", "#save"]:
        expect(other.locator(id)).to_be_disabled()
        expect(other.locator(id)).to_have_attribute("title", re.compile("another page has armed it"))
    expect(gain).to_be_disabled()
    expect(other.locator("#stop")).to_be_enabled()
    page.click("#disarm")
    expect(other.locator("#arm")).to_have_text("Arm")
    expect(gain).to_be_enabled()
    other.close()


def recorded(page):
    step("a recording starts and ends, and shows its path")
    button = page.get_by_role("button", name="Record", exact=True)
    button.focus()
    page.keyboard.press("Enter")
    expect(button).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#recorded")).to_have_text(re.compile(r"^\d{3,} rows$"))
    button.click()
    expect(page.locator("#toast")).to_contain_text("0 samples lost")
    expect(button).to_have_attribute("aria-pressed", "false")
    expect(page.locator("#recorded-note")).to_contain_text("0 samples lost")
    path, rows = re.search(r"recorded: (\S+): (\d+) rows", page.locator("#toast").text_content()).groups()
    assert Path(path).stat().st_size > 10 * int(rows), path


def chosen(page):
    step("signals removed by another page can be sent again, but not during a recording")
    page.evaluate("""() => {
        const other = new WebSocket(`ws://${location.host}/socket${location.search}`);
        other.onopen = () => other.send('{"say":"do","id":1,"station":0,"do":"stream","names":["POSITION","DES_POSITION"]}');
        other.onmessage = ({ data }) => { if (String(data).includes('"answer"')) other.close(); };
    }""")
    unsent = lambda name: page.locator(f'#signals .unsent[data-name="{name}"]')
    expect(unsent("des_force")).to_be_visible()
    page.fill("#signal-filter", "position")
    expect(unsent("des_force")).to_be_hidden()
    page.fill("#signal-filter", "")
    page.locator('#signals label[data-name="des_position"]').get_by_role("button", name="remove").click()
    expect(unsent("des_position")).to_be_visible()
    page.click("#record")
    expect(page.locator("#record")).to_have_attribute("aria-pressed", "true")
    unsent("des_force").get_by_role("button", name="send").click()
    expect(page.locator("#toast")).to_contain_text("end the recording first")
    page.screenshot(path=FOLDER / "page-chosen.png")
    page.click("#record")
    expect(page.locator("#record")).to_have_attribute("aria-pressed", "false")
    for name in ["des_force", "des_position"]:
        unsent(name).get_by_role("button", name="send").click()
        expect(unsent(name)).to_have_count(0)
    expect(page.locator("#signals button")).to_have_count(0)


def joint(browser, errors):
    server = Server()
    page = browser.new_page(viewport={"width": 1500, "height": 1000}, color_scheme="light")
    page.on("pageerror", lambda error: errors.append(str(error)))

    step("the page shows modules, scheme and a moving plot")
    start = time.monotonic()
    page.goto(server.url)
    page.wait_for_selector(".module")
    usable_s = time.monotonic() - start
    expect(page.locator("#scheme text", has_text="PIDCTRL_MOD").first).to_be_visible()
    page.wait_for_function("() => document.querySelector('#plots canvas')")
    expect(page.locator("#state-text")).to_contain_text("no client holds the lease")

    step("the page moves the device, and shows it")
    arm(page)
    page.wait_for_timeout(3000)
    wait_for_plot(page)
    page.screenshot(path=FOLDER / "joint.png")

    step("an edit is checked, then applied")
    gain = page.get_by_label("PIDCTRL_MOD K_PARAM")
    gain.fill("120")
    gain.press("Tab")
    expect(page.locator("#pending-check")).to_have_text("check passed")
    page.click("#apply")
    expect(page.locator("#pending")).to_be_hidden()
    expect(gain).to_have_value("120")

    step("a value out of range is refused with its range, and nothing changes")
    gain.fill("1e12")
    gain.press("Tab")
    expect(page.locator("#pending-check")).to_contain_text("1000000")
    expect(page.locator("#apply")).to_be_disabled()
    page.click("#drop")
    expect(gain).to_have_value("120")

    step("unplugging a required module is reported before it is applied")
    page.get_by_role("button", name="unplug PIDCTRL_MOD").click()
    expect(page.locator("#pending-check")).to_contain_text("DES_FORCE")
    expect(page.locator("#apply")).to_be_disabled()
    page.click("#drop")

    step("a module is plugged in and unplugged again")
    page.click("#add")
    page.fill("#adding-filter", "SIGGEN")
    page.keyboard.press("Enter")
    expect(page.locator("#pending-check")).to_have_text("check passed")
    page.click("#apply")
    expect(page.locator(".module", has_text="SIGGEN_MOD")).to_be_visible()
    expect(page.locator("#signals label", has_text="SIGNAL_OUT")).to_be_visible()
    page.get_by_role("button", name="unplug SIGGEN_MOD").click()
    expect(page.locator("#pending-check")).to_have_text("check passed")
    page.click("#apply")
    expect(page.locator(".module", has_text="SIGGEN_MOD, not plugged in")).to_be_visible()

    step("the trigger holds a step of the reference")
    # On a busy machine the lease can be lost, and the experiment waits.
    if not page.locator("#arm").is_disabled():
        arm(page)
    page.select_option("#trigger-source", "DES_POSITION")
    page.fill("#trigger-level", "0.25")
    page.select_option("#window", "1")
    page.select_option("#trigger-mode", "single")
    expect(page.locator("#trigger-state")).to_contain_text("fired at tick", timeout=15000)
    expect(page.locator("#run")).to_have_text("Held")
    page.screenshot(path=FOLDER / "page-trigger.png")
    page.select_option("#trigger-mode", "off")
    page.click("#run")
    for view in ["spectrum", "xy", "time"]:
        page.select_option("#view", view)
        page.wait_for_timeout(300)

    recorded(page)
    chosen(page)

    step("the reference follows the pointer, and is released")
    if not page.locator("#arm").is_disabled():
        arm(page)
    dial = page.locator("#device circle").bounding_box()
    x, y = dial["x"] + dial["width"] / 2, dial["y"] + dial["height"] / 2
    page.mouse.move(x + 60, y)
    page.mouse.down()
    page.mouse.move(x + 40, y - 70, steps=8)
    wanted = page.locator("#signals label", has_text="DES_POSITION").locator(".value")
    expect(wanted).to_contain_text(re.compile(r"1\.0[45]"))
    # While disarmed, its load has turned it far.
    expect(page.locator("#device text").first).to_contain_text(re.compile(r"^1\.0"), timeout=20000)
    page.mouse.up()
    expect(wanted).to_contain_text("0.5")

    step("arrow keys jog the reference until the focus leaves; a pointer above it changes nothing")
    page.locator("#device [role=slider]").focus()
    expect(wanted).to_have_text(re.compile(r"^0\.5\b"), timeout=20000)
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    page.mouse.move(x + 5, y - 30)
    expect(wanted).to_contain_text("0.6")
    page.locator("#device [role=slider]").blur()
    expect(wanted).not_to_contain_text("0.6")

    step("Esc stops the device")
    page.keyboard.press("Escape")
    expect(page.locator("#state-text")).to_contain_text("stopped")

    step("a fault caused by another client is shown in the scheme")
    # STOP has released the lease.
    expect(page.locator("#disarm")).to_be_disabled()
    connect("off", "PIDCTRL_MOD")
    expect(page.locator("#findings .fault")).to_contain_text("DES_FORCE", timeout=8000)
    expect(page.locator("#scheme text.wrong", has_text="DES_FORCE")).to_be_visible()
    page.screenshot(path=FOLDER / "page-fault.png")
    connect("on", "PIDCTRL_MOD")
    page.click("#start")
    expect(page.locator("#findings .fault")).to_have_count(0, timeout=8000)

    step("an open transaction of another client is aborted")
    connect("begin")
    expect(page.locator("#transaction")).to_be_visible(timeout=8000)
    page.click("#abort")
    expect(page.locator("#transaction")).to_be_hidden(timeout=8000)

    step("without a connection nothing is shown as armed, and STOP reports its failure")
    arm(page)
    server.kill()
    expect(page.locator("#line")).to_contain_text("no connection")
    expect(page.locator("#state-text")).to_contain_text("state unknown")
    expect(page.locator("#arm")).to_have_text("Arm")
    for id in ["#arm", "#disarm", "#start", "#reset", "#save"]:
        expect(page.locator(id)).to_be_disabled()
    page.keyboard.press("Escape")
    expect(page.locator("#toast")).to_contain_text("NOT STOPPED")

    step("the server restarts")
    server = Server()
    expect(page.locator("#line")).to_have_text("connected", timeout=8000)
    expect(page.locator("#state-text")).to_contain_text("no client holds the lease", timeout=8000)
    page.wait_for_timeout(500)
    wait_for_plot(page)

    two_pages(browser, page, server.url, errors)
    held_picture(browser, server.url, errors)

    step("a closed page ends motion")
    arm(page)
    page.close()
    onlooker = browser.new_page(viewport={"width": 390, "height": 840}, color_scheme="dark")
    onlooker.on("pageerror", lambda error: errors.append(str(error)))
    onlooker.goto(server.url)
    expect(onlooker.locator("#state-text")).to_contain_text("no client holds the lease")
    wide = onlooker.evaluate("() => document.documentElement.scrollWidth")
    assert wide <= 390, f"a phone is pushed sideways: {wide} px"
    onlooker.wait_for_timeout(1500)
    onlooker.screenshot(path=FOLDER / "page-phone.png")
    onlooker.close()
    server.kill()
    return usable_s


def own_edits(page):
    step("edits of one controller do not affect another one")
    gain = page.get_by_label(re.compile(r"^PIDCTRL_MOD K_PARAM"))

    def look_at(name):
        page.get_by_role("button", name=name).click()
        page.wait_for_selector(".module summary:has-text('PIDCTRL_MOD')", timeout=15000)

    look_at("elbow")
    of_elbow = gain.input_value()
    look_at("base")
    gain.fill("17")
    gain.press("Tab")
    # Before the check.
    look_at("elbow")
    expect(page.locator("#pending")).to_be_hidden()
    expect(page.locator("#apply")).to_be_disabled()
    expect(gain).to_have_value(of_elbow)
    look_at("base")
    expect(page.locator("#pending-check")).to_have_text("check passed", timeout=15000)
    expect(gain).to_have_value("17")
    page.click("#apply")
    expect(page.locator("#pending")).to_be_hidden(timeout=15000)
    expect(gain).to_have_value("17")
    look_at("elbow")
    expect(gain).to_have_value(of_elbow)


def editor_of_schemes(browser, errors):
    server = Server("bilateral")
    page = browser.new_page(viewport={"width": 1440, "height": 1600}, color_scheme="light")
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(server.url)
    page.wait_for_selector(".module")
    page.get_by_role("button", name="master").click()

    def connect_master(*words):
        command = [DIMSART, "connect", "sim:master", *words]
        return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout

    editor.build(page, step, connect_master, FOLDER)
    page.close()
    server.kill()


def layouts(browser, errors):
    for rig in ("joint", "arm", "phantom", "telerobot"):
        server = Server(rig)
        layout.hold(browser, server.url, rig, step, errors)
        if rig in ("arm", "telerobot"):
            access.hold(browser, server.url, rig, step, errors)
        server.kill()


def robots(playwright, errors):
    # With WebGL on the processor; the other tests have none, and the page works without.
    flags = [flag for flag in FLAGS if flag != "--disable-gpu"] + ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"]
    browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=flags)
    server = Server("telerobot")
    robot.hand(browser, server.url, step, errors)
    server.kill()
    server = Server("arm")
    robot.pictures(browser, server.url, FOLDER)
    robot.tip(browser, server.url, step, errors, FOLDER)
    server.kill()
    browser.close()


def seven(browser, errors):
    step("seven controllers, dark")
    server = Server("arm_bus")
    page = browser.new_page(viewport={"width": 1500, "height": 1000}, color_scheme="dark")
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(server.url)
    expect(page.locator("#stations button")).to_have_count(7)
    expect(page.locator("#fleet-rows tr")).to_have_count(7)
    expect(page.locator("#fleet-rows tr").first).to_contain_text("coordinator")
    page.wait_for_selector(".module")
    for name in ["base", "elbow"]:
        page.get_by_role("button", name=name).click()
        page.wait_for_selector(".module summary:has-text('PIDCTRL_MOD')", timeout=15000)
    page.wait_for_timeout(1500)
    page.screenshot(path=FOLDER / "seven-dark.png")
    own_edits(page)
    page.close()
    server.kill()


def main():
    FOLDER.mkdir(parents=True, exist_ok=True)
    errors = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=FLAGS)
        usable_s = joint(browser, errors)
        editor_of_schemes(browser, errors)
        scope.scope(browser, Server, lambda *files: Server(files=files), DIMSART, step, errors, FOLDER)
        server = Server("identify")
        tuning.tune(browser, server.url, step, errors, FOLDER)
        server.kill()
        layouts(browser, errors)
        seven(browser, errors)
        browser.close()
        robots(playwright, errors)
    assert not errors, errors
    print(f"page: usable {usable_s:.2f} s after it was opened")
    print("1 passed, 0 failed")


main()
