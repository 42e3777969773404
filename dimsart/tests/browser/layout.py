"""Test of the page's layout: nothing is clipped, overlaps or leaves its section, at three widths."""

FOUND = """() => {
    const found = [], seen = (element) => element.checkVisibility() && element.getClientRects().length > 0;
    const name = (element) => `${element.tagName} ${element.id || element.dataset?.edit || element.textContent.slice(0, 30)}`;
    if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} px wide`);
    for (const section of document.querySelectorAll("section, header")) {
        if (!seen(section)) continue;
        const box = section.getBoundingClientRect();
        const scrolls = (element) => { const parent = element.parentElement.closest("#scheme, #signals, #modules, #events, #pending-list"); return parent && parent.scrollHeight > parent.clientHeight; };
        for (const element of section.querySelectorAll("button, input, select, label, dd, dt, h2, p, li, summary")) {
            if (!seen(element)) continue;
            const own = element.getBoundingClientRect();
            if (own.left < box.left - 1 || own.right > box.right + 1) found.push(`${name(element)} leaves its section`);
            if (!scrolls(element) && own.bottom > box.bottom + 1) found.push(`${name(element)} is below its section`);
            if (element.matches("button, select") && element.scrollWidth > element.clientWidth + 1) found.push(`${name(element)} is clipped`);
        }
    }
    const controls = [...document.querySelectorAll("main button, main input, main select")].filter(seen).filter((one) => !one.closest("details:not([open])"));
    controls.forEach((one, place) => controls.slice(place + 1).forEach((other) => {
        if (one.closest("section") !== other.closest("section")) return;
        const [a, b] = [one, other].map((element) => element.getBoundingClientRect());
        if (a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1) found.push(`${name(one)} overlaps ${name(other)}`);
    }));
    for (const name of document.querySelectorAll(".parameter > span:first-child")) {
        const values = name.nextElementSibling.getBoundingClientRect(), own = name.getBoundingClientRect();
        const text = document.createRange();
        text.selectNodeContents(name);
        const right = text.getBoundingClientRect().right;
        if (seen(name) && right > values.left + 1 && own.top < values.bottom && values.top < own.bottom) found.push(`${name.textContent} is behind its values`);
    }
    for (const svg of document.querySelectorAll("#device svg")) {
        const box = svg.getBoundingClientRect();
        for (const text of svg.querySelectorAll("text")) {
            const own = text.getBoundingClientRect();
            if (own.left < box.left - 1 || own.right > box.right + 1) found.push(`${text.textContent} leaves the picture`);
        }
    }
    return found;
}"""


def hold(browser, url, rig, step, errors):
    step(f"{rig}: nothing is clipped or overlaps at 1440, 1024 and 390 px")
    for width in (1440, 1024, 390):
        page = browser.new_page(viewport={"width": width, "height": 1000}, color_scheme="light")
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(url)
        page.wait_for_selector(".module")
        page.wait_for_function("() => document.querySelector('#plots canvas')")
        page.wait_for_timeout(1000)
        found = page.evaluate(FOUND)
        assert not found, (rig, width, found)
        page.close()
