"""The section of RESULTS.md that compares processors, from the files of `make bench-record`."""
import json

from results_tables import table_text

TEXT = """A column for each processor on which `make bench-record` ran. Every ratio is of one run.
*Wanted* is what we ask of every processor; figures that miss it are missed, not left out. The
peak is that of multiply-adds, measured for each width in bits; the solve includes the
covariances.
"""


def read_records(folder):
    """The files of `make bench-record`, in order of their names."""
    return [json.loads(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.json"))]


def ratio_text(record, row):
    """Two digits after the point, or none from ten on. Empty: not measured there."""
    value = record["ratios"].get(row)
    if value is None:
        return ""
    return f"{value:.0f}" if value >= 10 else f"{value:.2f}"


def peak_text(record):
    return ", ".join(f"{peak} ({bits})" for bits, peak in record["peak_gflop_per_s"].items())


def table(records):
    """Rows in the order of the last record; a row that only another record has comes after them."""
    wanted = {}
    for record in reversed(records):
        wanted = wanted | {row: bound for row, bound in record["wanted"].items()
                           if row not in wanted}
    header = ["ratio", "wanted", *(f"{record['processor']}, {record['lanes']} lanes"
                                   for record in records)]
    return table_text(header, [
        ["caches", "", *(", ".join(record["caches"]) for record in records)],
        ["compiler", "", *(f"g++ {record['compiler']}" for record in records)],
        ["peak, GFLOP/s (bits)", "", *map(peak_text, records)],
        *([row, bound, *(ratio_text(record, row) for record in records)]
          for row, bound in wanted.items())])
