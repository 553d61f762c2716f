// Learning and evaluation: what gpom-learn and gpom-eval do.
#include "ports/python/src/parts.hpp"

#include "tools/eval/evaluate.hpp"
#include "tools/learn/learn.hpp"

#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace gpom_python
{

namespace
{

template <class Value> void take(const nb::dict &words, const char *name, Value &field)
{
    if (words.contains(name)) {
        field = nb::cast<Value>(words[name]);
    }
}

/// Options of keyword arguments; the caller in Python knows the names.
gpom_tools::LearnOptions learn_options(const nb::dict &words)
{
    gpom_tools::LearnOptions options;
    take(words, "command", options.command);
    take(words, "kernel", options.kernel);
    take(words, "method", options.method);
    take(words, "fix", options.fixed);
    take(words, "model", options.model);
    take(words, "seed", options.seed);
    take(words, "fraction", options.fraction);
    take(words, "free_weight", options.free_weight);
    take(words, "n_points", options.n_points);
    take(words, "first_m", options.first_m);
    take(words, "ell_max_m", options.ell_max_m);
    take(words, "n_hits", options.n_hits);
    take(words, "n_free", options.n_free);
    take(words, "composite", options.composite);
    take(words, "truth_paths", options.truth_paths);
    take(words, "keep_m", options.live.keep_m);
    take(words, "clear_scans", options.live.clear_scans);
    take(words, "beam_max", options.live.beam_max);
    take(words, "step_ops", options.live.step_ops);
    return options;
}

nb::object learn(const nb::handle &logs, const nb::dict &words)
{
    gpom_tools::LearnOptions options = learn_options(words);
    for (const nb::handle log : logs) {
        options.scans.push_back(tool_scans(log));
    }
    gpom_tools::LearnOutcome outcome;
    gpom_params_t params;
    {
        nb::gil_scoped_release no_gil;
        outcome = gpom_tools::learn(options);
        params = gpom_tools::to_six_digits(outcome.params());
    }
    nb::dict report;
    report["figures"] = gpom_tools::figures_table(outcome.fits, outcome.i_best);
    report["held_out_nll"] = outcome.fits[outcome.i_best].held_out.nll;
    report["held_out_auc"] = outcome.fits[outcome.i_best].held_out.auc;
    report["warnings"] = outcome.warnings;
    report["comment"] = outcome.comment;
    return nb::make_tuple(Params{params}, report);
}

std::string evaluate(const nb::handle &scans, const std::string &params_path,
                     const std::string &truth_path, const nb::dict &words)
{
    gpom_tools::EvalOptions options;
    options.scans_path = "scans";
    options.params_path = params_path;
    options.truth_path = truth_path;
    options.command = "gpom.evaluate()";
    take(words, "also", options.also_paths);
    take(words, "split", options.split);
    take(words, "rivals", options.rivals);
    take(words, "fraction", options.fraction);
    take(words, "seed", options.seed);
    take(words, "n_points", options.n_points);
    take(words, "after_m", options.after_m);
    const std::vector<gpom_tools::Scan> drive = tool_scans(scans);
    nb::gil_scoped_release no_gil;
    const gpom_tools::Trial trial = truth_path.empty() ? gpom_tools::log_trial(options, drive)
                                                       : gpom_tools::street_trial(options, drive);
    return gpom_tools::eval_json(options, trial, gpom_tools::evaluate(options, trial)).dump();
}

} // namespace

void add_learning(nb::module_ &module)
{
    module.def("learn", &learn, nb::arg("logs"), nb::arg("options"),
               "Parameters and a report; gpom.learn() is for users.");
    module.def("evaluate", &evaluate, nb::arg("scans"), nb::arg("params_path"),
               nb::arg("truth_path"), nb::arg("options"),
               "eval.json as a text; gpom.evaluate() is for users.");
}

} // namespace gpom_python
