"""Order of RESULTS.md: tables, then how they are judged, then the commands behind them."""
from dataclasses import dataclass

COMMANDS_TITLE = "## Commands"
COMMANDS_TEXT = """`$DATA` is the folder of the logs (the variable DATA of make);
`$STREETS/N.csv` and `N.pgm` come from `gpom-sim --seed N --out N.csv --truth N.pgm`. Where `$SEED`
stands, a command is run once for each of the seeds, and the tables show the mean.
"""


@dataclass(frozen=True)
class Commands:
    """Commands that made the tables of the section around them."""
    text: str


def tables_first(intro, sections, method):
    """The document. sections: texts, each heading one of its own, and Commands; the commands go to
    the end, under the headings of their sections."""
    body, appendix, heading_of = [intro], [COMMANDS_TITLE + "\n", COMMANDS_TEXT], {}
    heading, last = "", ""
    for part in sections:
        if not isinstance(part, Commands):
            body.append(part)
            if part.startswith("## "):
                heading = part.splitlines()[0].removeprefix("## ")
            continue
        first = heading_of.setdefault(part.text, heading)
        if heading != last:
            appendix.append(f"### {heading}\n")
            last = heading
        appendix.append(part.text if first == heading else f"As for \"{first}\".\n")
    return "\n".join([*body, *method, *appendix])
