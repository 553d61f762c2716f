"""Learning and evaluation: the C++ of gpom-learn and gpom-eval."""
import json
import os
import tempfile

from . import _core

_LEARN = {"kernel", "method", "fix", "model", "seed", "fraction", "free_weight", "n_points",
          "first_m", "ell_max_m", "n_hits", "n_free", "composite", "truth_paths", "keep_m",
          "clear_scans", "beam_max", "step_ops"}
_EVALUATE = {"also", "split", "rivals", "fraction", "seed", "n_points", "after_m"}


def _require_known(options, known, name):
    if unknown := sorted(set(options) - known):
        raise TypeError(f"{name}: no option {unknown[0]!r}; options are {', '.join(sorted(known))}")


def _logs_of(scans):
    """A list of logs from one log or several."""
    scans = list(scans)
    logs = [scans] if not scans or hasattr(scans[0], "laser_tuple") else scans
    return [[scan.laser_tuple() for scan in log] for log in logs]


def learn(scans, *, command=None, **options):
    """Learn parameters from the scans of one drive, or of a list of drives.

    options  those of gpom-learn: kernel ("all", "nn", "matern12", ...), model, fix, seed, fraction
             (None: for a live map), n_points, first_m [m], ell_max_m [m], n_hits, n_free,
             free_weight, method, composite, truth_paths, keep_m [m], clear_scans, beam_max,
             step_ops
    command  how the parameters were made, for the comment of their file; None: this call
    Returns  Params with six digits, as gpom-learn writes them, and a dict: figures (a table),
             held_out_nll, held_out_auc, warnings, comment (for Params.to_toml()).
    Raises   RuntimeError, in the words of gpom-learn.
    """
    _require_known(options, _LEARN, "learn")
    used = {name: value for name, value in options.items() if value is not None}
    call = ", ".join(f"{name}={value!r}" for name, value in sorted(used.items()))
    return _core.learn(_logs_of(scans), {**used, "command": command or f"gpom.learn({call})"})


def evaluate(scans, params, *, truth=None, **options):
    """Judge the map of a drive and its rivals, as gpom-eval does.

    truth    None: by beams that the maps did not get; path of a truth (PGM of gpom-sim): by it
    options  fraction of the beams that the maps get (0.04), split ("beams", "runs"), seed,
             n_points (with truth), after_m [m], rivals (True: OctoMap and the strong grid too),
             also (more parameter files)
    Returns  the contents of gpom-eval's eval.json; ["methods"] has the figures of each method.
    Raises   RuntimeError, in the words of gpom-eval.
    """
    _require_known(options, _EVALUATE, "evaluate")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "params.toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(params.to_toml())
        text = _core.evaluate([scan.laser_tuple() for scan in scans], path, str(truth or ""),
                              options)
    return json.loads(text)
