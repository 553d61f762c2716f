#!/usr/bin/env python3
"""Doxygen's input filter: a header whose comments are plain text becomes one with commands.

usage: tools/dev/docs_filter.py HEADER > FILTERED

In a comment `/** ... */` before a function, a line `name   text` after a blank line describes a
parameter, `Errors  text` the errors and `Cost: text` the cost. Lines stay where they are, so that a
warning names the line of the header.
"""
import re
import sys

COMMENT = re.compile(r"/\*\*.*?\*/", re.DOTALL)
PREFIX = re.compile(r"^(/\*\*<? ?| \* {0,2}|\s*)")
ITEM = re.compile(r"^([a-z]\w*(?:, [a-z]\w*)*) {2,}(.*)$")
ERRORS = re.compile(r"^Errors(?::| {2,}) *(.*)$")
COST = re.compile(r"^Cost(?::| {2,}) *(.*)$")
ONE_ERROR = re.compile(r"^ *(GPOM_ERR_\w+) {2,}(.*)$")
NUMBERED = re.compile(r"^\d+\. ")


def with_code(text):
    """`code` between backticks."""
    return re.sub(r"`([^`]*)`", r"<tt>\1</tt>", text)


def filtered_line(text, parameters):
    """One line of a comment without its star."""
    if match := ERRORS.match(text):
        rest = match.group(1)
        error = ONE_ERROR.match(rest)
        return "\\errors " + (f"\\li {error.group(1)}: {error.group(2)}" if error else rest)
    if match := COST.match(text):
        return "\\cost " + match.group(1)
    if (match := ITEM.match(text)) and set(match.group(1).split(", ")) <= parameters:
        return f"\\li <b>{match.group(1)}</b>: {match.group(2)}"
    if match := ONE_ERROR.match(text):
        return f"\\li {match.group(1)}: {match.group(2)}"
    return NUMBERED.sub("-# ", text)


def parameters_after(text, end):
    """Names in the parentheses of the declaration that follows a comment."""
    declaration = re.match(r"\s*([^;{]*?)\(([^;{]*)\)", text[end:])
    return set(re.findall(r"\w+(?=\s*(?:,|$))", declaration.group(2))) if declaration else set()


def filtered(text):
    def replace(match):
        parameters = parameters_after(text, match.end())
        lines, is_verbatim = [], False
        for line in match.group(0).split("\n"):
            prefix = PREFIX.match(line).group(0)
            body = line[len(prefix):]
            is_verbatim = (is_verbatim or "\\verbatim" in body) and "\\endverbatim" not in body
            if not is_verbatim:
                body = with_code(filtered_line(body, parameters))
            lines.append(prefix + body)
        return "\n".join(lines)
    return COMMENT.sub(replace, text)


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        sys.stdout.write(filtered(file.read()))


if __name__ == "__main__":
    main()
