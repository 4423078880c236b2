"""Runs a WASI program with wasmtime (PyPI): python3 tools/run_wasm.py PROGRAM.wasm [ARGUMENT...]"""

import sys

from wasmtime import Config, Engine, ExitTrap, Linker, Module, Store, WasiConfig

engine = Engine(Config())
linker = Linker(engine)
linker.define_wasi()
wasi = WasiConfig()
wasi.argv = sys.argv[1:]
wasi.inherit_stdout()
wasi.inherit_stderr()
store = Store(engine)
store.set_wasi(wasi)
instance = linker.instantiate(store, Module.from_file(engine, sys.argv[1]))
try:
    instance.exports(store)["_start"](store)
except ExitTrap as trap:
    sys.exit(trap.code)
