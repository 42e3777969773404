"""Test of the scheme editor: Table 1's master is built from an empty controller by mouse, then by keyboard."""

from playwright.sync_api import expect

# Modules of the master in their order, with their settings, and ports that differ from the default.
MASTER = [
    ("COMM_RXMOD", {"CRX_ADD_DATA": "CH2_WAVES", "CRX_CHANNEL": "2"}),
    ("WTRANSF_MOD", {"B_PARAM": "12", "CONF_MODE": "MASTER"}),
    ("PDCTRL_MOD", {"K_PARAM[0]": "2500"}),
    ("TIMEDELAY_MOD", {"TD_PARAM": "10"}),
    ("COMM_TXMOD", {"CTX_ADD_DATA": "CH1_TD_WAVES", "CTX_CHANNEL": "1"}),
]
NAMES = [name for name, _ in MASTER]
MODULES = "() => [...document.querySelectorAll('.module')].map((card) => card.dataset.module)"


def idle(page):
    """Waits until the controller has checked all edits."""
    expect(page.locator("#pending-check")).not_to_have_text("checking …", timeout=20000)


def modules(page, names):
    page.wait_for_function(f"(names) => JSON.stringify(({MODULES})()) === JSON.stringify(names)", arg=names, timeout=20000)
    idle(page)


def apply(page):
    idle(page)
    expect(page.locator("#pending-check")).to_have_text("check passed")
    page.click("#apply")
    expect(page.locator("#pending")).to_be_hidden(timeout=20000)


def field(page, edit):
    return page.locator(f'#modules [data-edit="{edit}"]')


def empty(page):
    """Removes all modules. A controller without modules does not pass its check: they stay pending."""
    for name in page.evaluate(MODULES):
        page.locator(f'#modules [data-edit="{name} remove"]').evaluate("(button) => button.click()")
    modules(page, [])


def by_mouse(page):
    for place, (name, settings) in enumerate(MASTER):
        page.click("#add")
        page.fill("#adding-filter", name)
        page.locator("#adding-list li:visible button").first.click()
        modules(page, NAMES[:place + 1])
        for parameter, value in settings.items():
            edit = field(page, f"{name} {parameter}")
            if edit.evaluate("(element) => element.tagName") == "SELECT":
                edit.select_option(value)
            else:
                edit.fill(value)
                edit.blur()
            idle(page)


def tab_to(page, script):
    """Moves the focus with the Tab key to an element for which a script is true."""
    for _ in range(400):
        if page.evaluate(f"() => {{ const e = document.activeElement; return Boolean({script}) }}"):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"the Tab key does not reach {script}")


def by_keyboard(page):
    for place, (name, settings) in enumerate(MASTER):
        tab_to(page, "e.id === 'add'")
        page.keyboard.press("Enter")
        page.keyboard.type(name)
        page.keyboard.press("Enter")
        modules(page, NAMES[:place + 1])
        for parameter, value in settings.items():
            tab_to(page, f"e.closest('#modules') && e.dataset.edit === '{name} {parameter}'")
            if page.evaluate("() => document.activeElement.tagName") == "SELECT":
                page.keyboard.press(value[0])
            else:
                page.keyboard.press("Control+a")
                page.keyboard.type(value)
            page.keyboard.press("Enter")
            idle(page)


def rows(connect):
    return [" ".join(row.split()) for row in connect("scheme").splitlines() if row.strip()]


def drag(page, port, signal):
    """Drags a port's dot in the diagram to the lane of a signal."""
    dot = page.locator(f'#scheme [data-edit="diagram {port}"]').bounding_box()
    lane = page.locator("#scheme text", has_text=signal).first.bounding_box()
    page.mouse.move(dot["x"] + dot["width"] / 2, dot["y"] + dot["height"] / 2)
    page.mouse.down()
    page.mouse.move(dot["x"] + 5, lane["y"] + lane["height"] / 2, steps=5)
    expect(page.locator("#scheme .lane.over")).to_have_count(1)
    page.mouse.up()
    idle(page)


def build(page, step, connect, folder):
    """`connect` runs `dimsart connect` with the master and returns its output."""
    found = {}
    for name, way in [("mouse", by_mouse), ("keyboard", by_keyboard)]:
        step(f"Table 1's master is built from an empty controller by {name}")
        empty(page)
        way(page)
        apply(page)
        found[name] = rows(connect)
    assert found["mouse"] == found["keyboard"], found
    built = "\n".join(found["mouse"])
    for name, settings in MASTER:
        assert f"MOD_ON {name}" in built, built
        # The default is not in the rows.
        for parameter, value in settings.items():
            if (parameter, value) != ("CONF_MODE", "MASTER"):
                assert f"{name} {parameter} {value}" in built, (parameter, built)

    step("a module is inserted, bound in the diagram, moved and duplicated; each change can be undone, also after Apply")
    page.locator('#scheme [data-edit="diagram add PDCTRL_MOD"]').click()
    page.fill("#adding-filter", "low-pass")
    page.keyboard.press("Enter")
    with_filter = [*NAMES[:2], "LOWPASS_MOD", *NAMES[2:]]
    modules(page, with_filter)
    expect(page.locator("#pending-check")).to_contain_text("SIGNAL, which has no provider")
    page.evaluate("scrollTo(0, 0)")
    expect(page.locator("#toast")).to_be_hidden()
    page.screenshot(path=folder / "page-editor.png")
    expect(page.locator("#apply")).to_be_disabled()
    drag(page, "LOWPASS_MOD PORT_SIGNAL_IN", "POSITION")
    expect(field(page, "LOWPASS_MOD PORT_SIGNAL_IN")).to_have_value("POSITION")
    apply(page)
    assert any("LOWPASS_MOD PORT_SIGNAL_IN POSITION" in row for row in rows(connect))
    title = page.locator('#scheme [data-edit="diagram title LOWPASS_MOD"]')
    title.focus()
    page.keyboard.press("Alt+ArrowRight")
    modules(page, [*NAMES[:3], "LOWPASS_MOD", *NAMES[3:]])
    page.locator('#modules [data-edit="LOWPASS_MOD duplicate"]').click()
    idle(page)
    expect(field(page, "LOWPASS_MOD.2 PORT_SIGNAL_IN")).to_have_value("POSITION")
    expect(page.locator("#pending-list")).to_contain_text("+ LOWPASS_MOD.2 at place 5")
    for _ in range(2):
        page.click("#undo")
        idle(page)
    expect(page.locator("#pending")).to_be_hidden()
    # Before the module was added.
    for _ in range(2):
        page.click("#undo")
        idle(page)
    modules(page, NAMES)
    apply(page)
    assert rows(connect) == found["mouse"]
    page.click("#redo")
    page.click("#redo")
    modules(page, with_filter)
    page.click("#drop")
    modules(page, NAMES)
