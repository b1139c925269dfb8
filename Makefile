# make            ./mics, one process        make MPI=1     ./mics_mpi, many processes
# make DEBUG=1    the same with all checks   make help      all targets
# As many jobs run at once as there are cores; make -j1 runs one after the other.
ifeq ($(MAKELEVEL),0)
MAKEFLAGS += -j$(shell getconf _NPROCESSORS_ONLN)
endif

VERSION := 0.2.0

FC_SERIAL := h5fc
FC_MPI := h5pfc
OPT := -O3 -march=native -finline-limit=2000
LTO := -flto=auto -ffat-lto-objects
# -Og halves the time of these tests against -O0; of what gcc thinks perhaps not set there, all is.
OPT_DEBUG := -Og -Wno-maybe-uninitialized -g -fbacktrace -fcheck=all,no-array-temps -finit-real=snan \
  -ffpe-trap=invalid,zero,overflow
OPT_SAN := -O1 -g -fcheck=all,no-array-temps -fsanitize=address,undefined \
  -fno-sanitize-recover=undefined -fno-omit-frame-pointer
FFLAGS := -std=f2008 -ffpe-summary=none -Wall -Wextra -Wimplicit-interface -Wconversion -fopenmp
# Without fused multiply-add the results do not depend on what the compiler happens to fuse; gcc 12
# fuses in its vectoriser of straight code whatever the first option says.
FFLAGS += -ffp-contract=off -fno-tree-slp-vectorize
FFLAGS += $(if $(CI),-Werror)
PYTHON := .venv/bin/python
CASE := input/blocks.nml

parallel := $(if $(MPI),mpi,serial)
checked := $(if $(DEBUG),-debug)$(if $(SAN),-san)
# C: what knows neither HDF5 nor MPI, compiled once for both variants; B: all else, and the programs.
C := build/common$(checked)
B := build/$(parallel)$(checked)
binary := mics$(if $(MPI),_mpi)$(if $(DEBUG),_debug)$(if $(SAN),_san)
compiler := $(if $(MPI),$(FC_MPI),$(FC_SERIAL))
checks := $(if $(SAN),$(OPT_SAN),$(if $(DEBUG),$(OPT_DEBUG)))
flags := $(FFLAGS) $(or $(checks),$(OPT) $(LTO))

other_twin := src/base/parallel_$(if $(MPI),serial,mpi).f90
sources := $(filter-out $(other_twin),$(wildcard src/*.f90 src/*/*.f90))
tests := $(wildcard verification/unit/*/test_*.f90)
drivers := $(wildcard verification/drivers/*.f90)
# What verification/test_units.py runs of this variant: for each folder one program, test_FOLDER.
run_here := $(if $(MPI),$(shell grep -l '^! ranks:' $(tests)),$(tests))
folders := $(notdir $(patsubst %/,%,$(sort $(dir $(run_here)))))
mains := $(folders:%=$(B)/units_$(parallel)_%.f90)
unit_sources := $(wildcard verification/unit/*.f90) $(tests) $(mains)
unit_objects := $(foreach folder,$(B) $(C),$(patsubst %.f90,$(folder)/%.o,$(notdir $(unit_sources))))
unit_sources += $(drivers)
unit_programs := $(folders:%=$(B)/test_%)
driver_programs := $(drivers:verification/drivers/%.f90=$(B)/%)
vpath %.f90 $(sort $(dir $(sources) $(unit_sources))) $(C)

.DELETE_ON_ERROR:
.SECONDEXPANSION:
.PHONY: all units everything deps run test verify mutate soak worlds bench bench-contact \
  paper-ensemble gallery docs reference lint clean help install install-tools FORCE

all: $(binary)

help:
	@echo 'make deps     install what is missing: compiler, HDF5, MPI, Python packages in .venv;'
	@echo '               no tool installs anything by itself; test, docs and lint add what they need'
	@echo 'make          build ./mics          make MPI=1    build ./mics_mpi'
	@echo 'make DEBUG=1  build ./mics_debug, with every run-time check'
	@echo 'make SAN=1    ./mics_san, under the address and undefined behaviour sanitizers'
	@echo 'make install  copy the program and the cases of input to PREFIX=/usr/local (DESTDIR=, MPI=1)'
	@echo 'make install-tools  the Python tools there, in an environment of their own, and mics-tools'
	@echo 'make run      deps, build, run $(CASE), draw the pictures, make the page'
	@echo 'make test     deps, all builds, every quick test'
	@echo 'make verify   every verification case; writes verification/report (QUICK=1, FULL=1)'
	@echo 'make mutate   break formulas one by one; each must turn a test red'
	@echo 'make soak     faults many times: kills, full disks, broken files, all builds, ranks; many hours'
	@echo 'make worlds   N=500 worlds drawn at random from SEED=1 on, judged by laws; LAW=still: by that'
	@echo 'make bench    time jobs and growth; writes build/bench.json; FULL=1: whole jobs; AGAINST=old.json'
	@echo 'make bench-contact  time the dry pile of N=64 hexapods, THREADS=1'
	@echo 'make paper-ensemble  the fifty drops of the paper, their shares and their page; 20 minutes.'
	@echo '               RUNS=50; MOVES=20: besides, what moves the shares, 20 coarse runs of each'
	@echo 'make gallery  do all that docs/gallery.md and the tutorials say, in build/gallery; 20 minutes'
	@echo 'make reference  write docs/reference.md and docs/mics-case.schema.json anew'
	@echo 'make docs     pages to browse, build/docs/site/index.html; every link is followed'
	@echo 'make lint     style of the Fortran and Python sources, sizes against tools/budgets.toml'
	@echo 'make clean    remove what make has built'
	@echo 'Variables: OPT="-O2" for a portable binary, LTO= for a quick build, FC_SERIAL, FC_MPI, CASE'

# `make V=1` shows whole commands.
say = $(if $(V),,@echo '  $(1)';)

# NO_LTO=1 links as the objects are; the other way of linking links anew.
# What gcc thinks perhaps not set is told of each file; across files it errs.
link := $(flags) -Wno-maybe-uninitialized $(if $(NO_LTO),-fno-lto)
$(B)/link: FORCE
	$(call keep,$(link))
$(binary): $$(OBJECTS_mics) $(B)/link
	$(if $(OBJECTS_mics),,$(error src/mics.f90, the main program, is missing))
	$(call say,LD $@)$(compiler) $(link) -o $@ $(filter %.o,$^)

units: $(unit_programs) $(if $(MPI)$(DEBUG),,$(driver_programs))

# Every variant that `make test` runs, side by side but for the two that share objects. Only the
# first is optimised as a whole when it is linked, which takes longer than to compile it;
# verification/test_bits.py compares the bits of both.
variants := serial-variant mpi-variant debug-variant
.PHONY: $(variants)
everything: $(variants)
mpi-variant: serial-variant
serial-variant:
	@$(MAKE) --no-print-directory all units
mpi-variant:
	@$(MAKE) --no-print-directory MPI=1 NO_LTO=1 all units
debug-variant:
	@$(MAKE) --no-print-directory DEBUG=1 all units

$(unit_programs): $(B)/test_%: $$(OBJECTS_units_$(parallel)_$$*)
	$(call say,LD $@)$(compiler) $(flags) -fno-lto -o $@ $^
$(driver_programs): $(B)/%: $$(OBJECTS_$$*)
	$(call say,LD $@)$(compiler) $(flags) -fno-lto -o $@ $^

# The main program of a folder of tests.
$(mains): $(B)/units_$(parallel)_%.f90: $(B)/sources tools/unit_main.sh
	@tools/unit_main.sh units_$(parallel)_$* $(filter verification/unit/$*/%,$(run_here)) > $@

# The tests themselves need no speed, what they test does.
flags_here = $(if $(filter $(unit_objects),$@),$(FFLAGS) $(or $(checks),-O0),$(flags))
compile = $(call say,FC $@)$(compiler) $(flags_here) -I$(C) -J$(@D) -c -o $@ $<
$(B)/%.o: %.f90 $(B)/settings
	$(compile)
$(C)/%.o: %.f90 $(C)/settings
	$(compile)

# Compiler and flags; a change rebuilds everything. The compiler is tried, not trusted to exist.
keep = @mkdir -p $(@D); echo '$(1)' | cmp -s - $@ || echo '$(1)' > $@
tried = $(shell echo '$(compiler) $(flags)' | cmp -s - $@ || \
  tools/try_compiler.sh $(parallel) $(compiler) || echo no)
$(B)/settings: FORCE
	$(if $(tried),$(error $(compiler) cannot build a Fortran program with HDF5; run: make deps))
	$(call keep,$(compiler) $(flags))
# h5fc and h5pfc are scripts around a compiler, as a rule the same one.
$(C)/settings: $(B)/settings FORCE
	$(call keep,$(shell $(compiler) --version | head -n 1) $(flags))

# A shell that a signal ends tells its number, which is not the same everywhere: Linux 10, macOS 30.
sigusr1 = $(shell sh -c 'kill -s USR1 $$$$' 2> /dev/null; expr $$? % 128)

errno = $(if $(filter Linux,$(shell uname)),__errno_location,__error)

$(C)/system.f90: tools/system.in FORCE
	@mkdir -p $(C)
	$(if $(filter-out 0,$(sigusr1)),,$(error SIGUSR1 ends no shell here, so its number is unknown))
	@sed -e 's/@SIGUSR1@/$(sigusr1)/' -e 's/@ERRNO@/$(errno)/' $< > $@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi

$(C)/build_info.f90: FORCE
	@mkdir -p $(C)
	@awk -v version='$(VERSION)' -v flags='$(flags)' \
	  -v revision="$$(git describe --always --dirty --abbrev=12 2>/dev/null || echo unknown)" \
	  -f tools/build_info.awk < /dev/null > $@.new
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi

$(B)/sources: FORCE
	$(call keep,$(sources) $(unit_sources) $(run_here))

written = $(C)/build_info.f90 $(C)/system.f90
$(B)/depend.mk: $(B)/sources $(sources) $(unit_sources) tools/depend.awk $(written)
	@awk -v B=$(B) -v C=$(C) -f tools/depend.awk $(sources) $(unit_sources) $(written) > $@

no_build := deps lint clean help install install-tools run test verify mutate soak worlds bench bench-contact \
  paper-ensemble gallery docs reference everything $(variants)
ifneq ($(filter-out $(no_build),$(or $(MAKECMDGOALS),all)),)
include $(B)/depend.mk
# What a source left in the other folder when it began or ceased to use HDF5 is not to be found.
ifneq ($(wildcard $(ELSEWHERE)),)
$(shell rm -f $(ELSEWHERE) $(ELSEWHERE:.o=_m.mod))
endif
endif

deps = FC_SERIAL='$(FC_SERIAL)' FC_MPI='$(FC_MPI)' tools/deps.sh
deps:
	@$(deps) shape ensemble survey serve paper

# How threads wait, and in which pages memory comes: measured in docs/performance.md.
run bench: export GOMP_SPINCOUNT ?= 1000
run bench: export GLIBC_TUNABLES ?= glibc.malloc.hugetlb=1

run: deps
	@$(MAKE) --no-print-directory
	./mics < $(CASE)
	$(PYTHON) tools/plot_pile.py $(CASE)
	$(PYTHON) tools/plot_history.py $(CASE)
	$(PYTHON) -m micstools.cli report $(CASE)

test:
	@$(deps) test shape ensemble survey serve paper
	+@verification/run_tests

verify: deps
	@$(MAKE) --no-print-directory
	@$(PYTHON) verification/verify.py

mutate:
	@$(deps) test shape ensemble survey serve paper
	@$(PYTHON) verification/mutate.py

soak:
	@$(deps) test
	@for build in '' MPI=1 DEBUG=1 SAN=1; do $(MAKE) --no-print-directory $$build || exit 1; done
	@$(PYTHON) verification/run_soak.py
	@$(MAKE) --no-print-directory worlds

worlds: N := 500
SEED := 1
worlds:
	@$(deps) test
	@$(MAKE) --no-print-directory
	@PYTHONPATH=verification:tools $(PYTHON) -m worlds --seed $(SEED) --n $(N) \
	  $(if $(LAW),--law $(LAW)) $(if $(SHRINK),--shrink)

bench: deps
	@$(MAKE) --no-print-directory all
	@$(MAKE) --no-print-directory MPI=1
	@$(PYTHON) tools/bench.py --out build/bench.json $(if $(FULL),--whole) $(if $(AGAINST),--against $(AGAINST))

bench-contact: N := 64
THREADS := 1
bench-contact: deps
	@$(MAKE) --no-print-directory
	@$(PYTHON) tools/bench_contact.py --n $(N) --threads $(THREADS)

RUNS := 50
MOVES := 0
paper-ensemble:
	@$(deps)
	@$(MAKE) --no-print-directory
	@$(PYTHON) tools/paper_ensemble.py --runs $(RUNS) --moves $(MOVES)

gallery:
	@$(deps) test shape ensemble survey serve paper
	@$(MAKE) --no-print-directory
	@PAGES=gallery.md $(PYTHON) -m pytest -q tools/tests/test_tutorials.py -k works --basetemp build/gallery
	@$(PYTHON) -m pytest -q tools/tests/test_tutorials.py --basetemp build/gallery/tutorials

# What the program says about its own input.
reference:
	@$(MAKE) --no-print-directory
	@$(PYTHON) tools/write_reference.py
	./mics --help=json > docs/mics-case.schema.json

docs:
	@$(deps) docs
	@$(PYTHON) tools/build_docs.py

lint:
	@$(deps) lint
	@tools/lint.sh

# For other processors than this one: make OPT='-O3 -march=x86-64-v3'.
PREFIX := /usr/local
install:
	@test -x $(binary) || { echo 'install: there is no ./$(binary) yet; run make' >&2; exit 1; }
	install -d '$(DESTDIR)$(PREFIX)/bin' '$(DESTDIR)$(PREFIX)/share/mics/input'
	install -m 755 $(binary) '$(DESTDIR)$(PREFIX)/bin'
	install -m 644 LICENSE CHANGELOG.md '$(DESTDIR)$(PREFIX)/share/mics'
	install -m 644 input/* '$(DESTDIR)$(PREFIX)/share/mics/input'

# An environment knows where it is, so there is no DESTDIR here.
install-tools:
	python3 -m venv '$(PREFIX)/lib/mics'
	'$(PREFIX)/lib/mics/bin/python' -m pip install --quiet --prefer-binary '.[pictures]'
	install -d '$(PREFIX)/bin'
	ln -sf ../lib/mics/bin/mics-tools '$(PREFIX)/bin/mics-tools'

clean:
	rm -rf build mics mics_mpi mics_debug mics_mpi_debug mics_san
