"""Which frames of a window are recorded and which are a network's own, drawn under two sliders.

    viewer.feeding(real=5, fed=5)

The same in a notebook and in a built page: a few lines of HTML, no kernel.
"""

from __future__ import annotations

import html
import uuid

from ...errors import ViewerError
from ..pictures import palette
from .figure import PageFigure

_FRAMES, _MOST = 60, 20

_PAGE = """
<figure class="motionlab-feeding" id="{key}">
<style>
#{key} .cells {{ display: flex; gap: 1px; margin: .5em 0; }}
#{key} .cells i {{ flex: 1; height: 2.2em; border-radius: 2px; background: {recorded}; }}
#{key} .cells i.own {{ background: {own}; }}
#{key} label {{ display: inline-flex; align-items: center; gap: .5em; margin-right: 1.5em; }}
#{key} .key {{ display: inline-block; width: 1em; height: 1em; border-radius: 2px; }}
</style>
<div><label>u, recorded <input type="range" name="real" min="1" max="{most}" value="{real}">
<output>{real}</output></label><label>v, fed back
<input type="range" name="fed" min="0" max="{most}" value="{fed}"> <output>{fed}</output></label></div>
<div class="cells" role="img" aria-label="Frames of a window, recorded or fed back">{cells}</div>
<p><span class="key" style="background: {recorded}"></span> recorded frame&ensp;
<span class="key" style="background: {own}"></span> the network's own&ensp;<span class="said"></span></p>
{caption}
<script>
(() => {{
  const figure = document.getElementById("{key}");
  const [real, fed] = figure.querySelectorAll("input");
  const draw = () => {{
    const [u, v] = [Number(real.value), Number(fed.value)];
    figure.querySelectorAll("i").forEach((cell, t) => cell.classList.toggle("own", t % (u + v) >= u));
    figure.querySelectorAll("output").forEach((text, i) => {{ text.textContent = [u, v][i]; }});
    figure.querySelector(".said").textContent = v
      ? `At most ${{v}} frames on its own, ${{Math.round(1000 * v / {fps})}} ms; ` +
        `${{Math.round(100 * u / (u + v))}} % recorded.`
      : "Teacher forcing: it never sees what it said.";
  }};
  real.addEventListener("input", draw);
  fed.addEventListener("input", draw);
  draw();
}})();
</script>
</figure>
"""


def feeding(
    real: int = 5, fed: int = 5, *, fps: float = 30.0, caption: str | None = None
) -> PageFigure:
    """The pattern of auto-conditioned training (acLSTM, figure 1), under sliders for u and v.

    Parameters
    ----------
    real, fed : u recorded frames, then v of the network's own; where the sliders stand at first.
    fps : frames per second, to tell how long v frames are.
    caption : a text below.

    Raises
    ------
    ViewerError : `real` is not 1 or more, or `fed` not 0 or more.
    """
    if not (isinstance(real, int) and isinstance(fed, int) and real >= 1 and fed >= 0):
        raise ViewerError(f"feeding: u is {real!r}, v {fed!r}; u must be 1 or more, v 0 or more.")
    recorded = [t % (real + fed) < real for t in range(_FRAMES)]
    return PageFigure(
        _PAGE.format(
            key=f"feeding-{uuid.uuid4().hex[:8]}",
            recorded=palette.COLORS["mocap"],
            own=palette.COLORS["acLSTM"],
            cells="".join("<i></i>" if is_real else '<i class="own"></i>' for is_real in recorded),
            real=real,
            fed=fed,
            most=max(_MOST, real, fed),
            fps=fps,
            caption=f"<figcaption>{html.escape(caption)}</figcaption>" if caption else "",
        )
    )
