#!/usr/bin/env python3
"""Answer the same queries by scikit-learn, with one regressor for each query's neighbourhood.

usage: bench/sklearn_gp.py NEIGHBOURHOODS.json OUT.json

Reads the output of `speed --neighbourhoods`. Writes for each number of neighbours the queries a
second of processor time, and the largest difference of mean and variance from the library.
"""
import json
import sys
import time

import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

ROUNDS = 5


def fit_and_predict(data, query):
    places = np.array(query["hits"] + query["free"])
    n_hits, n_free = len(query["hits"]), len(query["free"])
    labels = np.repeat([1.0, -1.0], [n_hits, n_free])
    noise = np.repeat([data["sn2"], data["sn2_free"]], [n_hits, n_free])
    kernel = ConstantKernel(data["sf2"]) * Matern(data["ell_m"], nu=0.5)
    gp = GaussianProcessRegressor(kernel, alpha=noise, optimizer=None)
    mean, deviation = gp.fit(places, labels).predict(np.zeros((1, 2)), return_std=True)
    return mean[0], deviation[0] ** 2


def measure(data, queries):
    answers = [fit_and_predict(data, query) for query in queries]
    differences = [max(abs(mean - query["mean"]), abs(variance - query["variance"]))
                   for (mean, variance), query in zip(answers, queries)]
    seconds = []
    for _ in range(ROUNDS):
        start = time.process_time()
        for query in queries:
            fit_and_predict(data, query)
        seconds.append(time.process_time() - start)
    return {"queries_per_second": len(queries) / sorted(seconds)[ROUNDS // 2],
            "difference_max": max(differences)}


def main():
    with open(sys.argv[1], encoding="utf-8") as file:
        data = json.load(file)
    figures = {name: measure(data, queries) for name, queries in data.items()
               if isinstance(queries, list)}
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        json.dump(figures, file, indent=1)


if __name__ == "__main__":
    main()
