// Entry point of the unit and property tests; `make test SEED=n` replays a random run.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

int main(int argc, char **argv) { return doctest::Context(argc, argv).run(); }
