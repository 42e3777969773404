"""Test of the scope: plots by drag and drop, math channels, cursors, step figures, traces, layouts, exports, recordings."""

import math
import struct
import subprocess

import control
import numpy
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from playwright.sync_api import expect

import tuning


def opened(browser, url, errors, **more):
    page = browser.new_page(viewport={"width": 1440, "height": 1400}, color_scheme="light", **more)
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(url)
    page.wait_for_selector("#plots figure canvas")
    return page


def legends(page):
    """Labels of the curves, by plot."""
    return page.evaluate("""() => [...document.querySelectorAll('#plots figure')].map((figure) =>
        [...figure.querySelectorAll('.u-legend .u-label')].slice(1).map((label) => label.textContent))""")


def until_legends(page, wanted):
    page.wait_for_function("""(wanted) => JSON.stringify([...document.querySelectorAll('#plots figure')].map((figure) =>
        [...figure.querySelectorAll('.u-legend .u-label')].slice(1).map((label) => label.textContent))) === JSON.stringify(wanted)""", arg=wanted, timeout=60000)


def formulas(page):
    """Math channels and step figures against other implementations."""
    evaluated = page.evaluate("""async ([texts, signals]) => {
        const { parse } = await import("/math.js");
        return texts.map((text) => parse(text).evaluate((name) => signals[name], 5, 0.5));
    }""", [["A + 2 * B[0] - A / 4", "-(A - B[0]) * sqrt(abs(B[0]))", "max(A, B[0]) - min(A, 1e0)", "rate(A)", "integral(B[0])", "lowpass(A, 0.25)"],
           {"A": [1, 2, 4, 8, 16], "B[0]": [3, -1, 2, 0, 5]}])
    a, b = numpy.array([1, 2, 4, 8, 16.0]), numpy.array([3, -1, 2, 0, 5.0])
    share, filtered = 1 - math.exp(-2 * math.pi * 0.25 * 0.5), [a[0]]
    for value in a[1:]:
        filtered.append(filtered[-1] + share * (value - filtered[-1]))
    expected = [a + 2 * b - a / 4, -(a - b) * numpy.sqrt(abs(b)), numpy.maximum(a, b) - numpy.minimum(a, 1), numpy.diff(a) / 0.5, numpy.cumsum(b) * 0.5, filtered]
    for found, wanted in zip(evaluated, expected):
        found = [value for value in found if value is not None]
        assert numpy.allclose(found[-len(wanted):], wanted), (found, wanted)
    wrong = page.evaluate("""async (texts) => {
        const { parse } = await import("/math.js");
        return texts.map((text) => { try { parse(text); return ""; } catch (error) { return error.message; } });
    }""", ["A +", "(A", "foo(A)", "A ^ 2", "min(A)"])
    assert wrong == ["expected a number, a signal or ( at character 4", "expected ) at character 3", "unknown function foo (known: abs, sqrt, sin, cos, min, max, rate, integral, lowpass) at character 1",
                     "unexpected ^ at character 3", "min has 2 argument(s) at character 1"], wrong
    # A second-order system: python-control is the oracle.
    times = numpy.arange(0, 2, 0.001)
    system = control.tf([400], [1, 8, 400])
    _, response = control.step_response(system, times)
    wanted = control.step_info(response, times, yfinal=1)
    values = [0.3] * 200 + list(0.3 + 0.5 * response)
    reference = [0.3] * 200 + [0.8] * len(response)
    found = page.evaluate("""async (all) => (await import("/step_figures.js")).stepFigures(...all)""", [[0.001 * i for i in range(len(values))], reference, values])
    assert abs(found["rise_s"] - wanted["RiseTime"]) < 0.002 and abs(found["overshoot"] - wanted["Overshoot"] / 100) < 0.002, (found, wanted)
    assert abs(found["settling_s"] - wanted["SettlingTime"]) < 0.003 and abs(found["start_s"] - 0.2) < 1e-9, (found, wanted)
    assert page.evaluate("""async () => (await import("/step_figures.js")).stepFigures([0, 1, 2, 3], [1, 1, 1, 1], [0, 1, 1, 1])""") is None


def plots(page, step):
    step("scope: signals are dropped on plots; a layout survives a reload, by address and by name")
    until_legends(page, [["POSITION", "DES_POSITION"], ["DES_FORCE"]])
    signal = lambda name: page.locator("#signals label").filter(has=page.locator(f".name:text-is('{name}')"))
    signal("POSITION").drag_to(page.locator("#plots figure").nth(1))
    until_legends(page, [["POSITION", "DES_POSITION"], ["DES_FORCE", "POSITION"]])
    signal("DES_FORCE").drag_to(page.locator("#plots .new-plot"))
    until_legends(page, [["POSITION", "DES_POSITION"], ["DES_FORCE", "POSITION"], ["DES_FORCE"]])
    page.locator("summary:has-text('math channels')").click()
    page.fill("#math-name", "ERROR")
    page.fill("#math-text", "DES_POSITION - POSITION +")
    page.click("#math-form button")
    expect(page.locator("#toast")).to_contain_text("expected a number")
    page.fill("#math-text", "1000 * (DES_POSITION - POSITION)")
    page.fill("#math-unit", "mrad")
    page.click("#math-form button")
    wanted = [["POSITION", "DES_POSITION"], ["DES_FORCE", "POSITION"], ["DES_FORCE"], ["ERROR"]]
    until_legends(page, wanted)
    page.select_option("#window", "5")
    page.select_option("#columns", "2")
    page.click("#layout-save")
    page.fill("#naming-name", "tuning")
    page.keyboard.press("Enter")
    page.reload()
    page.wait_for_selector("#plots figure canvas")
    until_legends(page, wanted)
    expect(page.locator("#window")).to_have_value("5")
    expect(page.locator("#columns")).to_have_value("2")
    signal("DES_FORCE").locator("input").uncheck()
    until_legends(page, [["POSITION", "DES_POSITION"], ["POSITION"], ["ERROR"]])
    page.select_option("#layout", "tuning")
    until_legends(page, wanted)
    boxes = [page.locator("#plots figure").nth(place).bounding_box() for place in range(2)]
    assert abs(boxes[0]["y"] - boxes[1]["y"]) < 2 and boxes[0]["x"] < boxes[1]["x"]
    page.select_option("#columns", "1")
    page.select_option("#window", "2")


def cursors(page, step):
    step("scope: cursors by keyboard, with differences; a held window moves over the stored rows")
    page.select_option("#window", "1")
    # Until rows before the window are stored.
    for _ in range(100):
        page.click("#run")
        if float(page.evaluate("() => document.querySelector('#pan').min")) < -0.5:
            break
        page.click("#run")
        page.wait_for_timeout(200)
    expect(page.locator("#pan")).to_be_visible()
    page.focus("#plots")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    for _ in range(5):
        page.keyboard.press("Control+Shift+ArrowRight")
    row = page.locator("#cursor-values tr").first
    expect(row).to_contain_text("0.1 s (10 Hz)")
    names = page.locator("#cursor-values th").all_text_contents()
    assert names[:3] == ["time", "POSITION", "DES_POSITION"], names
    page.click("#cursors-clear")
    expect(page.locator("#cursors")).to_be_hidden()
    assert float(page.evaluate("() => document.querySelector('#pan').min")) < -0.5
    page.click("#run")


def traces(page, step):
    step("scope: the step figures of a trace, and a stored trace to compare with")
    page.click("#keep")
    expect(page.locator("#traces li")).to_contain_text("trace 1")
    assert legends(page)[0] == ["POSITION", "POSITION (trace 1)", "DES_POSITION", "DES_POSITION (trace 1)"], legends(page)
    page.locator("#traces input[type=checkbox]").uncheck()
    until_legends(page, [["POSITION", "DES_POSITION"], ["DES_FORCE", "POSITION"], ["DES_FORCE"], ["ERROR"]])
    page.locator("#traces").get_by_role("button", name="Remove").click()
    expect(page.locator("#traces li")).to_have_count(0)
    page.select_option("#view", "db")
    page.wait_for_function("() => document.querySelector('#plots .u-axis') || document.querySelector('#plots canvas')")
    page.select_option("#view", "time")


def exports(page, step, folder):
    step("scope: exports as PNG and MCAP; the MCAP file loads as a trace")
    page.click("#run")
    with page.expect_download() as found:
        page.click("#export-png")
    picture = folder / "scope.png"
    found.value.save_as(picture)
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    with page.expect_download() as found:
        page.click("#export-mcap")
    file = folder / "scope.mcap"
    found.value.save_as(file)
    with file.open("rb") as stream:
        messages = [(channel.topic, message.data) for _, channel, message in make_reader(stream).iter_messages()]
    assert len(messages) > 500 and {topic for topic, _ in messages} == {"/joint"}, len(messages)
    page.set_input_files("#recording-file", file)
    expect(page.locator("#traces li")).to_contain_text("scope.mcap")
    assert "POSITION (scope.mcap)" in legends(page)[0]
    page.set_input_files("#recording-file", picture)
    expect(page.locator("#toast")).to_contain_text("not an MCAP file")
    page.click("#run")


def devices(browser, url, step, errors):
    step("scope: signals of two devices in one plot, on one time axis")
    page = opened(browser, url, errors)
    page.locator("#signals details.other summary").first.click()
    page.locator("#signals details.other label").filter(has=page.locator(".name:text-is('POSITION')")).first.locator("input").check()
    page.wait_for_function("""() => [...document.querySelectorAll('#plots .u-label')].some((label) => label.textContent === 'slave POSITION')""")
    labels = legends(page)[0]
    assert "master POSITION" in labels and "slave POSITION" in labels, labels
    page.close()


def changed(source, target):
    """Copies a recording with one changed word of DES_FORCE in tick 150."""
    with source.open("rb") as stream, target.open("wb") as out:
        reader, writer = make_reader(stream), Writer(out, compression=CompressionType.NONE)
        writer.start(profile="ros2", library="test")
        for attachment in reader.iter_attachments():
            writer.add_attachment(attachment.create_time, attachment.log_time, attachment.name, attachment.media_type, attachment.data)
        channels = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            if channel.id not in channels:
                known = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = (writer.register_channel(channel.topic, channel.message_encoding, known), schema.data.decode())
            own, definition = channels[channel.id]
            data = bytearray(message.data)
            if channel.topic == "/joint" and struct.unpack_from("<Q", data, 4)[0] == 150:
                names = [line.split(" # ")[1].split(" (")[0] for line in definition.splitlines()[2:] if " # " in line]
                place = 4 + 16 + 4 * names.index("DES_FORCE")
                struct.pack_into("<f", data, place, struct.unpack_from("<f", data, place)[0] + 1)
            writer.add_message(own, message.log_time, bytes(data), message.publish_time, message.sequence)
        writer.finish()


def recordings(browser, dimsart, serve, step, errors, folder):
    step("view: a recording is shown whole; the first difference of its replay is marked")
    subprocess.run([dimsart, "run", "joint", "--signals", "mcap", "--out", folder / "run"], check=True, stdout=subprocess.DEVNULL)
    file, other = folder / "run/signals.mcap", folder / "changed.mcap"
    changed(file, other)
    server = serve(file)
    page = opened(browser, server.url, errors)
    expect(page.locator("#replay li")).to_contain_text("replay identical", timeout=60000)
    span = page.evaluate("() => document.querySelector('#window').value")
    assert span == "all" and legends(page)[0] == ["POSITION", "DES_POSITION"], (span, legends(page))
    expect(page.locator("#step-figures li").first).to_contain_text("overshoot")
    page.screenshot(path=folder / "view.png")
    page.close()
    server.kill()
    server = serve(other, file)
    page = opened(browser, server.url, errors)
    expect(page.locator("#replay li").first).to_contain_text("tick 150", timeout=60000)
    expect(page.locator("#replay li").first).to_contain_text("DES_FORCE[0]")
    assert any("(" in label for label in legends(page)[0]), legends(page)
    page.screenshot(path=folder / "view-difference.png")
    page.close()
    server.kill()


def scope(browser, serve, serve_recordings, dimsart, step, errors, folder):
    server = serve("joint")
    page = opened(browser, server.url, errors)
    formulas(page)
    plots(page, step)
    cursors(page, step)
    traces(page, step)
    exports(page, step, folder)
    tuning.presets(page, step)
    page.close()
    server.kill()
    server = serve("telerobot")
    devices(browser, server.url, step, errors)
    server.kill()
    recordings(browser, dimsart, serve_recordings, step, errors, folder)
