"""The viewer's page, as files for a server or inlined for a report."""

import json
import zlib
from base64 import b64encode
from importlib.resources import files

from corporeal.render.png_writer import ZLIB_LEVEL

VIEW_SCRIPTS = ("three.min.js", "take.js", "splats.js", "stage.js", "cards.js", "page.js")
"""Of the view, each after those that it imports."""
INLINE_VIEW_HTML = """<div id="view"><p class="unseen">The 3D view is drawn by scripts, and takes a moment. Where this sentence stays, this browser does not run them: the video below and all else on this page need none.</p></div>
<script type="text/plain" id="view-modules">{modules}</script>
<script type="text/plain" id="view-take">{take}</script>
<style>
{style}</style>
<script type="module">
try {{
const inflated = async id => {{
  const raw = Uint8Array.from(atob(document.getElementById(id).textContent), c => c.charCodeAt(0))
  return new Response(new Blob([raw]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer()
}}
const urls = {{}}
for (const [name, text] of JSON.parse(new TextDecoder().decode(await inflated('view-modules')))) {{
  const linked = Object.entries(urls).reduce((t, [other, url]) => t.replaceAll(`'./${{other}}'`, `'${{url}}'`), text)
  urls[name] = URL.createObjectURL(new Blob([linked], {{type: 'text/javascript'}}))
}}
const {{Take}} = await import(urls['take.js']), {{Viewer}} = await import(urls['page.js'])
window.viewer = new Viewer(document.getElementById('view'), [new Take(await inflated('view-take'))], {{inside: true}})
}} catch (error) {{
  document.querySelector('#view').textContent = `This browser cannot show the 3D view (${{error.message}}). The video below and all else on this page work.`
}}
</script>"""  # noqa: E501


def web_file(name: str) -> str:
    """Return the text of one of the page's files."""
    return files("corporeal.render.web").joinpath(name).read_text(encoding="utf-8")


def inline_view(take: bytes) -> str:
    """Return the view of one take as HTML that fetches nothing."""
    modules = json.dumps([(name, web_file(name)) for name in VIEW_SCRIPTS]).encode()
    return INLINE_VIEW_HTML.format(modules=_packed(modules), take=_packed(take), style=web_file("viewer.css"))


def _packed(data: bytes) -> str:
    return b64encode(zlib.compress(data, ZLIB_LEVEL)).decode()
