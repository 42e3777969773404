"""Test of identification and tuning: gains against python-control, and the whole path on a simulated joint."""

import math

import control
import numpy
from playwright.sync_api import expect


def formulas(page):
    def computed(call, *arguments):
        return page.evaluate(f"async (all) => (await import('/gains.js')).{call}(...all)", list(arguments))

    for joint, hz, damping, integral in [((0.05, 0.2), 5, 0.7, True), ((1.3, 0.0), 20, 1.0, False), ((0.4, 3.0), 2, 0.5, True)]:
        inertia, viscous = joint
        gains = computed("gainsFor", {"inertia": inertia, "viscous": viscous}, {"bandwidth_hz": hz, "damping": damping, "hasIntegral": integral})
        law = control.tf([gains["D"], gains["K"], gains["I"]], [1, 0]) if integral else control.tf([gains["D"], gains["K"]], [1])
        plant = control.tf([1], [inertia, viscous, 0])
        closed = control.feedback(law * plant, 1)
        assert abs(control.bandwidth(closed) / (2 * math.pi * hz) - 1) < 0.01, (control.bandwidth(closed), hz)
        poles = [pole for pole in control.poles(control.minreal(closed, verbose=False)) if abs(pole.imag) > 1e-6]
        if poles and gains["D"] > 0:
            assert abs(-poles[0].real / abs(poles[0]) - damping) < 0.01, (poles, damping)
        delay_s = 0.002
        found = computed("marginsOf", {"inertia": inertia, "viscous": viscous}, gains, {"delay_s": delay_s})
        _, margin_deg, _, crossover = control.margin(law * plant)
        margin_deg -= math.degrees(crossover * delay_s)
        assert abs(found["phase_margin_deg"] - margin_deg) < 1 and abs(found["crossover_hz"] * 2 * math.pi / crossover - 1) < 0.01, (found, margin_deg, crossover)
        # The gain margin: the loop with the delay has this phase.
        w = numpy.logspace(-1, 5, 200000)
        response = control.frequency_response(law * plant, w)
        phase = numpy.unwrap(response.phase) - w * delay_s
        after = (w > crossover) & (phase <= -math.pi)
        first = numpy.argmax(after)
        assert abs(found["gain_margin"] * response.magnitude[first] - 1) < 0.02, (found, response.magnitude[first])


def tune(browser, url, step, errors, folder):
    step("tune: excite, identify, choose gains, try them in a simulation, apply them")
    page = browser.new_page(viewport={"width": 1440, "height": 1400}, color_scheme="light")
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto(url)
    page.wait_for_selector("#plots figure canvas")
    formulas(page)
    page.locator("summary:has-text('Identify and tune')").click()
    expect(page.locator("#excite")).to_be_disabled()
    assert "arm" in page.locator("#excite").get_attribute("title")
    page.click("#arm")
    page.wait_for_selector(".verdict.good", timeout=60000)
    expect(page.locator("#excite")).to_be_enabled()
    page.fill("#tune-amplitude", "50")
    page.click("#excite")
    expect(page.locator("#toast")).to_contain_text("amplitude 50 is out of range")
    page.fill("#tune-amplitude", "0.7")
    page.click("#excite")
    expect(page.locator("#excite-state")).to_contain_text("s left")
    expect(page.locator("#excite-state")).to_have_text("finished: identify", timeout=60000)
    page.click("#identify")
    row = page.locator("#identified tr", has_text="inertia")
    expect(row).to_be_visible(timeout=60000)
    inertia = float(row.locator("td").text_content().split()[0])
    # The rig's joint has a pendulum of 0.05 kg m² behind its torque sensor.
    assert abs(inertia / 0.05 - 1) < 0.05, inertia
    expect(page.locator("#suggested")).to_contain_text("K = ")
    page.fill("#tune-bandwidth", "4")
    suggested = page.locator("#suggested").text_content()
    page.click("#tune-try")
    expect(page.locator("#traces li")).to_contain_text("simulated, 4 Hz", timeout=30000)
    page.screenshot(path=folder / "page-tune.png")
    page.click("#tune-apply")
    expect(page.locator("#pending-count")).to_contain_text("3", timeout=60000)
    expect(page.locator("#pending-check")).to_have_text("check passed", timeout=60000)
    # A reload keeps the pending changes.
    page.reload()
    expect(page.locator("#pending-count")).to_contain_text("3", timeout=60000)
    gain = float(suggested.split("K = ")[1].split(",")[0])
    expect(page.locator("#pending-check")).to_have_text("check passed", timeout=60000)
    page.click("#apply")
    expect(page.locator("#pending")).to_be_hidden(timeout=60000)
    page.wait_for_function("(gain) => Math.abs(document.querySelector('[data-edit=\"PIDCTRL_MOD K_PARAM\"]').value / gain - 1) < 0.001", arg=gain, timeout=60000)
    page.close()


def presets(page, step):
    step("joint: a stored position is approached at limited speed and held; then the experiment continues")
    position = "() => parseFloat(document.querySelector('#device text').textContent)"
    expect(page.locator("#preset-go")).to_be_disabled()
    page.click("#preset-save")
    page.fill("#naming-name", "home")
    page.keyboard.press("Enter")
    expect(page.locator("#preset")).to_have_value("home")
    home = page.evaluate(position)
    page.click("#arm")
    page.wait_for_selector(".verdict.good", timeout=60000)
    page.wait_for_function(f"(home) => Math.abs(({position})() - home) > 0.2", arg=home, timeout=60000)
    page.click("#preset-go")
    page.wait_for_function(f"(home) => Math.abs(({position})() - home) < 0.1", arg=home, timeout=60000)
    # Longer than the experiment would stay there.
    for _ in range(10):
        page.wait_for_timeout(200)
        assert abs(page.evaluate(position) - home) < 0.15, page.evaluate(position)
    page.click("#preset-release")
    page.wait_for_function(f"(home) => Math.abs(({position})() - home) > 0.2", arg=home, timeout=60000)
    page.click("#preset-delete")
    expect(page.locator("#preset option")).to_have_count(0)
    page.click("#disarm")
