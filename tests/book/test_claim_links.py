"""Claims that are named in the text lead to the ledger."""

import pytest

KNOWN = {"W8": ("w8", "No hop. (not testable here)"), "Z1": ("z1-plain", "Freezes. (partly)")}


@pytest.fixture(scope="module")
def claim_links(extension):
    return extension("claim_links")


def test_names_become_links_and_nothing_else_does(claim_links):
    from docutils import nodes
    from docutils.core import publish_doctree

    page = publish_doctree(
        "Z1 at the head\n==============\n\nClaim *W8* and W99, Z1: see ``W8`` and `W8 there <x.html>`_.\n"
    )
    before = page.astext()
    claim_links.link(page, KNOWN, "claims.html")
    assert page.astext() == before
    links = [(a.astext(), a["refuri"], a.get("reftitle")) for a in page.findall(nodes.reference)]
    assert links == [
        ("W8", "claims.html#w8", KNOWN["W8"][1]),
        ("Z1", "claims.html#z1-plain", KNOWN["Z1"][1]),
        ("W8 there", "x.html", None),
    ]


def test_every_claim_is_known_with_its_verdict(claim_links):
    from experiments.claims import verdicts

    known = claim_links.told()
    assert set(known) >= {claim["id"] for claim in verdicts.claims()} | {"W1", "S10"}
    assert known["W1"] == known["W1-variety"]
    assert known["W9"][0] == "w9" and "(not testable here: " in known["W9"][1]


def test_a_chapter_has_a_table_of_its_claims(claim_links):
    from experiments.claims import verdicts

    rows = claim_links.table(4)[2:]
    assert [row.split(" | ")[0] for row in rows] == [
        f"| {claim['id']}" for claim in verdicts.claims() if claim.get("chapter") == 4
    ]
    assert all(row.count("|") == 3 and ".verdict ." in row for row in rows)
    with pytest.raises(ValueError, match="chapter 1"):
        claim_links.table(1)
