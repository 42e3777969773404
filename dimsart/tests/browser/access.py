"""Test of accessibility: axe finds no violation, and at 200 % zoom nothing is clipped."""

from axe_playwright_python.sync_playwright import Axe

import layout


def hold(browser, url, rig, step, errors):
    step(f"{rig}: axe finds no violation, light and dark; nothing is clipped at 200 % zoom")
    for scheme in ("light", "dark"):
        # A browser window of 1440 px has 720 CSS px at 200 %.
        for width in (1440, 720):
            page = browser.new_page(viewport={"width": width, "height": 700}, color_scheme=scheme, device_scale_factor=1440 / width, bypass_csp=True)
            page.on("pageerror", lambda error: errors.append(str(error)))
            page.goto(url)
            page.wait_for_selector("#plots figure canvas")
            page.evaluate("() => { for (const element of document.querySelectorAll('details')) element.open = true; }")
            page.wait_for_timeout(300)
            found = Axe().run(page).response["violations"]
            texts = [f"{one['id']}: {one['help']}: {[node['html'][:120] for node in one['nodes'][:3]]}" for one in found]
            assert not texts, (rig, scheme, width, texts)
            assert not page.evaluate(layout.FOUND), (rig, scheme, width, page.evaluate(layout.FOUND))
            page.close()
