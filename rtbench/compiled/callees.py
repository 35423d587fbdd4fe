"""How functions are compiled that are called by compiled ones alone: without machine code.

numba makes machine code of every function it compiles. Of a callee nobody runs it: each caller
takes its intermediate code, and what the entry holds in the end is compiled with the entry. Leaving
it out changes no instruction of the entry and saves a fifth of the time.
"""

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _Intermediate(JITCodeLibrary):
    """Optimised code to link with, which the execution engine never sees."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return 0: nothing is there to be called from Python."""
        self._ensure_finalized()
        return 0

    @property
    def codegen(self):
        """Numba asks for it to set the environment that Python functions have: there is none."""
        return self

    def set_env(self, env_name: str, env: object) -> None:
        """Leave it: it is for code that makes Python objects, which callees cannot."""


class CalleeCompiler(Compiler):
    """Numba's compiler (its option ``pipeline_class``) for what only compiled functions call."""

    def define_pipelines(self):
        """Return numba's own passes; what they make goes into a library without machine code."""
        state = self.state
        state.library = _Intermediate(state.targetctx.codegen(), state.func_id.func_qualname)
        return super().define_pipelines()
