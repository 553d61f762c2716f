# examples/ as a user would build them; those that need LCM are built by their tests.

EXAMPLE_FLAGS := -std=c99 -pedantic-errors $(COMMON) -Ibuild/host-release/include $(CFLAGS)
EXAMPLES := $(addprefix $(BUILD)/examples/,bare_main_loop host_program planner)
examples: $(EXAMPLES) ## Build the examples that need no LCM: build/host-release/examples
.PHONY: examples

$(BUILD)/examples/%.o: examples/%.c $(BUILD)/flags | presets $(COMPILER)
	$(call compile,$(CC) $(EXAMPLE_FLAGS) $(EXAMPLE_DEFINES))
$(BUILD)/examples/%.o: tests/firmware/board/%.c $(BUILD)/flags | $(COMPILER)
	$(call compile,$(CC) $(EXAMPLE_FLAGS))
$(BUILD)/examples/bare_main_loop.o: EXAMPLE_DEFINES = -DLANES=$(if $(filter 1,$(BARE)),1,16)
$(BUILD)/examples/bare_main_loop: $(addprefix $(BUILD)/examples/,board.o semihosting_host.o)
$(EXAMPLES): %: %.o $(BUILD)/libgpom.a
	$(call link,$(CC) $(EXAMPLE_FLAGS),$(CORE_LIBS))

# The same main loop on a Cortex-M, with the board that tests have.
$(BUILD)/bare_main_loop.elf: $(addprefix $(BUILD)/examples/,bare_main_loop.o board.o)
firmware-image: $(BUILD)/bare_main_loop.elf

-include $(wildcard $(BUILD)/examples/*.d)

test-programs: examples
