"""What somebody does who has only the page: upload, look, change, run, compare, export."""

import base64
import io
import zipfile

import pytest

import corporeal as co
from chromium import browser
from corporeal.io.gltf.glb_writer import write_glb

READY = "!!window.viewer?.stats.ready && viewer.stats.drawn > 2"
DROP = """(() => {
  const raw = Uint8Array.from(atob('DATA'), c => c.charCodeAt(0)), all = new DataTransfer()
  all.items.add(new File([raw], 'NAME'))
  const fallen = new DragEvent('drop', {dataTransfer: all, bubbles: true, cancelable: true})
  document.querySelector('.drop').dispatchEvent(fallen)
})()"""
LONG = 240.0
"""[s]"""


def drop(tab, name, data):
    """Let a file fall onto the drop zone."""
    tab.run(DROP.replace("DATA", base64.b64encode(data).decode()).replace("NAME", name))


@pytest.mark.slow
def test_from_an_upload_to_an_export_by_the_page_alone(tmp_path):
    from corporeal.viewer.run_exports import RunExports
    from corporeal.viewer.run_requests import RunRequests
    from corporeal.viewer.run_store import RunStore
    from corporeal.viewer.uploads import UploadLimits
    from corporeal.viewer.web_app import SiteOptions, make_app
    from viewer_server import LOCAL, serving

    runs = tmp_path / "runs"
    runs.mkdir()
    block = co.ball("wood", radius=0.05, at=(0, 0, 0.05), name="wooden_ball")
    model = tmp_path / "ball.glb"
    write_glb(model, co.build_scene(block, duration=0.1, fps=30))
    shelf = RunStore((), runs)
    work = RunRequests(shelf, runs)
    # The disk of who runs this may be nearly full.
    work.inbox.limits = UploadLimits(free_disk_bytes=0)
    app = make_app(SiteOptions(shelf, works=True), LOCAL, (*work.routes(), *RunExports(shelf).routes()))
    try:
        with serving(app) as server, browser(tmp_path) as tab:
            tab.open(server.address)
            tab.until("!!window.home?.ready")
            assert "Drop a file above" in tab.run("document.body.innerText")
            # What is no model is refused in one sentence.
            drop(tab, "letter.txt", b"Dear Sir or Madam")
            said = tab.until("document.querySelector('.bad')?.innerText")
            assert said.startswith("letter.txt: Neither a GLB") and "\n" not in said.strip()
            assert [path for path in runs.rglob("*") if path.is_file()] == []
            tab.errors.clear()  # the browser notes an answer of 400 by itself
            # What it is taken for.
            drop(tab, "ball.glb", model.read_bytes())
            tab.until("document.querySelector('.job')?.innerText.includes('see what')", LONG)
            tab.run("document.querySelector('.job a').click()")
            tab.until(READY)
            assert "not simulated yet" in tab.run("viewer.state.textContent")
            assert tab.run("viewer.playButton.disabled && viewer.at.disabled")
            tab.run("document.querySelector('.part').click()")
            tab.until("viewer.card.innerText.includes('wood')")
            tab.run("viewer.openTab('Audit')")
            tab.until("viewer.panel.innerText.includes('Nothing has been simulated')")
            # Steel, and thrown; a velocity out of reach is refused in one sentence.
            tab.run("viewer.openTab('Change')")
            tab.until("!!document.querySelector('.three')")
            tab.run("document.querySelector('.edit select').onfocus()")
            tab.until("document.querySelector('.edit select').options.length > 50")
            type_in(tab, ".edit select", "steel", "change")
            type_in(tab, ".three input", "1000", "input")
            tab.run("document.querySelector('.panel .do').click()")
            assert "at most 100 m/s" in tab.until("viewer.panel.querySelector('.bad')?.innerText")
            tab.errors.clear()
            type_in(tab, ".three input", "0.5", "input")
            tab.run("document.querySelector('.panel .do').click()")
            tab.until("viewer.panel.innerText.includes('ball-2 is done')", LONG)
            # The first one as it is, then both beside each other.
            tab.run("viewer.openTab('Look')")
            tab.run("viewer.panel.querySelector('.note .do').click()")
            tab.until("viewer.panel.innerText.includes('ball is done')", LONG)
            tab.run("viewer.openTab('Change')")
            tab.run("[...viewer.panel.querySelectorAll('a')].at(-1).click()")
            tab.until("window.viewer?.stages?.length === 2 && viewer.stats.drawn > 2")
            for word in ("wood", "steel", "0.5, 0, 0"):
                tab.until(f"viewer.panel.innerText.includes('{word}')")
            # Export what was simulated.
            tab.open(f"{server.address}/view/ball-2")
            tab.until(READY)
            tab.run("viewer.openTab('Export')")
            tab.run("viewer.panel.querySelector('.line button').click()")
            link = tab.until("viewer.panel.querySelector('a')?.getAttribute('href')", LONG)
            packed = zipfile.ZipFile(io.BytesIO(server.ask(link).body))
            assert any(name.endswith(".glb") for name in packed.namelist())
            assert tab.errors == []
    finally:
        work.close()


def type_in(tab, selector, value, event):
    """Set a field as a person does, and let the page know."""
    tab.run(
        f"(() => {{ const field = viewer.panel.querySelector('{selector}'); "
        f"field.value = '{value}'; field.dispatchEvent(new Event('{event}')) }})()"
    )
