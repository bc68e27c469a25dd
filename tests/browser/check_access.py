"""The part of check_book.py that looks for what readers stumble over who hear a page or use keys alone.

axe-core's own rules; what it calls serious or critical is a trouble.
"""

from pathlib import Path

AXE = Path(__file__).parents[2] / "web" / "node_modules" / "axe-core" / "axe.min.js"
GRAVE = ("serious", "critical")
# style sheets are there already; a page from disk may not ask for them again
FOUND = """async () => (await axe.run(document, { resultTypes: ["violations"], preload: false })).violations
  .map(({ id, impact, help, nodes }) => ({ id, impact, help, where: nodes.map(({ target }) => target.join(" ")) }))"""


def check_access(visit) -> None:
    """Every grave fault of a page by name, how often, and where it is first; `visit` is check_book's."""
    visit.page.evaluate(f"{AXE.read_text(encoding='utf-8')}; 0")
    for fault in visit.page.evaluate(FOUND):
        if fault["impact"] in GRAVE:
            where = fault["where"]
            visit.trouble(
                f"{fault['impact']} for screen readers or keys: {fault['id']}, {len(where)} times, "
                f"first at {where[0]}: {fault['help']}"
            )
