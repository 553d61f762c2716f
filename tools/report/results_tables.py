"""Tables of RESULTS.md: figures of gpom-eval as Markdown."""
import json

from profile_cells import PROFILE_TITLES, profile_cells

PRESETS = ("indoor", "campus", "street")
METRICS = (("auc", "AUC", 4), ("fp_at_tp95", "FP@95", 4), ("nll", "NLL", 4), ("ece", "ECE", 4))
BAND = (("nll", "NLL, band", 4), ("ece", "ECE, band", 4))
RIVALS = (("strong_grid", "strong grid"), ("octomap", "OctoMap"))


class Figures:
    """Metrics of every method by table, data and seed."""

    def __init__(self, reports):
        self.reports = reports

    def methods(self, table):
        """Keys and labels in the order of gpom-eval, without other presets (see cross_table)."""
        found = {}
        for (name, *_), report in self.reports.items():
            if name == table:
                found |= {m["key"]: m["label"] for m in report["methods"]}
        hidden = {f"gp_{preset}" for preset in PRESETS}
        return {key: label for key, label in found.items() if key not in hidden}

    def of(self, table, data, key, part="all"):
        """The method's entries, one for each seed. Empty if the method was not run."""
        return [method for (name, where, _), report in self.reports.items()
                if name == table and where == data
                for method in report["methods"] if method["key"] == key and part in method]

    def values(self, table, data, key, metric, part="all"):
        return [method[part][metric] for method in self.of(table, data, key, part)]

    def profiles(self, table, data, key):
        return [method["profile"] for method in self.of(table, data, key, "profile")]


def mean(values):
    return sum(values) / len(values)


def mean_and_spread(values, digits):
    if not values:
        return "-"
    text = f"{mean(values):.{digits}f}"
    return text if len(values) < 2 else f"{text} ({max(values) - min(values):.{digits}f})"


def over_data(per_data):
    """Means over the data, for each seed."""
    return [mean(column) for column in zip(*per_data)] if all(per_data) else []


def settings_of(entries):
    return "; ".join(dict.fromkeys(entry.get("setting", "") for entry in entries))


def table_text(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def columns_of(values):
    """Cells of all metrics, then of the band's. values(metric, part): one value for each seed."""
    return [mean_and_spread(values(metric, part), digits)
            for part, metrics in (("all", METRICS), ("band", BAND))
            for metric, _, digits in metrics]


def log_table(figures, table, names):
    header = ["log", "method", *(title for _, title, _ in METRICS + BAND), "chosen"]
    rows = []
    for key, label in figures.methods(table).items():
        cells = columns_of(lambda metric, part, key=key: over_data(
            [figures.values(table, name, key, metric, part) for name in names]))
        rows.append((len(names), ["**mean**", label, *cells, ""]))
        for i, name in enumerate(names):
            cells = columns_of(lambda metric, part, name=name, key=key:
                               figures.values(table, name, key, metric, part))
            rows.append((i, [name, label, *cells, settings_of(figures.of(table, name, key))]))
    rows.sort(key=lambda row: row[0])
    return table_text(header, [row for _, row in rows])


def log_profile_table(figures, table, names):
    rows = [[name, label, *profile_cells(figures.profiles(table, name, key))]
            for name in names for key, label in figures.methods(table).items()]
    return table_text(["log", "method", *PROFILE_TITLES], rows)


def street_profile_table(figures, names):
    rows = [[label, *profile_cells([profile for name in names
                                    for profile in figures.profiles("street", name, key)])]
            for key, label in figures.methods("street").items()]
    return table_text(["method", *PROFILE_TITLES], rows)


def is_ahead(figures, table, name, rival, metric):
    own, other = (mean(figures.values(table, name, key, metric)) for key in ("gp_query", rival))
    return own > other if metric == "auc" else own < other


def nll_over_rival(figures, table, name, rival):
    own, other = (mean(figures.values(table, name, key, "nll")) for key in ("gp_query", rival))
    return own / other


def ahead_table(figures, tables, names):
    """Metrics in which the GP's mean beats a rival's, and the GP's NLL over the rival's."""
    header = ["split, share", "rival", *names]
    rows = []
    for table in tables:
        for rival, label in RIVALS:
            cells = []
            for name in names:
                behind = [title for metric, title, _ in METRICS[:3]
                          if not is_ahead(figures, table, name, rival, metric)]
                ratio = nll_over_rival(figures, table, name, rival)
                ahead = "all three" if not behind else "not in " + ", ".join(behind)
                cells.append(f"{ahead}; {ratio:.2f}")
            rows.append([table, label, *cells])
    return table_text(header, rows)


def street_table(figures, names, part):
    header = ["method", *names, "mean AUC", "mean FP@95", "mean NLL", "mean ECE"]
    header += [title for _, title, _ in BAND] if part == "near" else []
    header.append("GP better in AUC, FP@95, NLL on")
    rows = []
    own = {metric: [figures.values("street", name, "gp_query", metric, part)[0] for name in names]
           for metric, *_ in METRICS}
    for key, label in figures.methods("street").items():
        all_values = {metric: [value for name in names
                               for value in figures.values("street", name, key, metric, part)]
                      for metric, *_ in METRICS}
        cells = [" / ".join(f"{all_values[metric][i]:.{digits}f}" for metric, digits in
                            (("auc", 3), ("fp_at_tp95", 3), ("nll", 3)))
                 for i in range(len(names))]
        means = [mean_and_spread(all_values[metric], digits) for metric, _, digits in METRICS]
        means += [mean_and_spread([value for name in names for value in
                                   figures.values("street", name, key, metric, "band")], digits)
                  for metric, _, digits in (BAND if part == "near" else ())]
        wins = [sum((a > b) if metric == "auc" else (a < b)
                    for a, b in zip(own[metric], all_values[metric]))
                for metric in ("auc", "fp_at_tp95", "nll")]
        won = "" if key == "gp_query" else ", ".join(map(str, wins)) + f" of {len(names)}"
        rows.append([label, *cells, *means, won])
    return table_text(header, rows)


def cross_table(figures, presets, places):
    """NLL of each preset on all data; places are (table, data, own preset, part)."""
    rows = []
    for table, name, own, part in places:
        cells, means = [], []
        for preset in presets:
            key = "gp_query" if table == "street" and preset == own else f"gp_{preset}"
            values = figures.values(table, name, key, "nll", part)
            text = mean_and_spread(values, 4)
            means.append(mean(values) if values else float("inf"))
            cells.append(f"**{text}**" if preset == own else text)
        rows.append([name, *cells, presets[means.index(min(means))]])
    return table_text(["data", *(f"{preset}.toml" for preset in presets), "best"], rows)


def neighbour_table(report):
    rows = [[row["label"], f"{row['auc']:.4f}", f"{row['nll']:.4f}", f"{row['mean_error_max']:.3f}"]
            for row in report["neighbours"]]
    return table_text(["hits + free segments", "AUC", "NLL", "largest difference of means"], rows)


def solve_table(bench):
    """Time of the sparse solve over that of the dense one, from a folder of `make bench`."""
    run = json.loads((bench / "speed.json").read_text(encoding="utf-8"))
    medians = {row["run_name"]: row for row in run["benchmarks"]
               if row.get("aggregate_name") == "median"}
    rows = []
    for name, row in medians.items():
        if name.startswith("solve-sparse/ell"):
            ell, n = name.removeprefix("solve-sparse/ell").split("/n")
            dense = medians[name.replace("sparse", "dense")]
            rows.append([n, ell, f"{100 * row['nonzeros']:.1f}",
                         f"{row['cpu_time'] / dense['cpu_time']:.1f}"])
    return table_text(["neighbours", "ell [m]", "% of K not zero", "time, sparse / dense"],
                      sorted(rows, key=lambda row: (int(row[0]), int(row[1])))), \
        run["context"]["lanes"]
