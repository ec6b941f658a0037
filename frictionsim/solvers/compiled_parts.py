"""Kernels that are parts of others, without machine code of their own.

numba makes machine code of each function that it compiles, whoever calls it. A part is copied into
the kernels that call it, and nobody else ever calls it: its machine code would be made for nothing,
which for the parts of a belt took a fourth of the time. The code that is copied is the same, and so
is every bit of a result.
"""

from typing import Any

from numba.core import codegen, compiler, compiler_machinery, typed_passes

# Their types are of no use here: most are missing.
_Library: Any = codegen.JITCodeLibrary
_Compiler: Any = compiler.CompilerBase
_Pass: Any = compiler_machinery.LoweringPass
_register: Any = compiler_machinery.register_pass
_builder: Any = compiler.DefaultPassBuilder


class _NoMachineCode:
    """A code generator as far as a library without machine code asks for one."""

    def set_env(self, env_name: str, env: Any) -> None:
        """Set nothing: there is no address to write it to."""


class PartLibrary(_Library):  # type: ignore[misc]
    """The optimised code of a part, to be linked into the kernels that call it.

    Attributes
    ----------
    is_scalar : bool
        The part is arithmetic in the order of the source, without fast math: there are no loops to
        be made of vector instructions before it is copied.
    """

    is_scalar = False

    @property
    def codegen(self) -> Any:
        """The object by which numba sets addresses in machine code."""
        return _NoMachineCode()

    def _optimize_final_module(self) -> None:
        """Optimise scalar code once, with the first of numba's two rounds.

        The kernel that the code is copied into is optimised in both. For a hundred parts within
        each other the second round takes a fifth of the compilation, and makes no step faster.
        """
        if not self.is_scalar:
            _Library._optimize_final_module(self)
            return
        level = self._codegen._opt_level
        passes, builder = self._codegen._module_pass_manager(
            loop_vectorize=False, slp_vectorize=False, opt=level, cost="cheap"
        )
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        """Finalise the code without handing it to the engine."""
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Return that there is no machine code."""
        self._ensure_finalized()
        return 0


@_register(mutates_CFG=False, analysis_only=False)
class _UsePartLibrary(_Pass):  # type: ignore[misc]
    """Have the code put into a `PartLibrary`, where numba would make a library of its own."""

    _name = "frictionsim_use_part_library"

    def __init__(self) -> None:
        _Pass.__init__(self)

    def run_pass(self, state: Any) -> bool:
        """Make the library."""
        state.library = PartLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.is_scalar = not state.flags.fastmath.flags
        return True


class PartCompiler(_Compiler):  # type: ignore[misc]
    """The passes of numba, with a library of another kind."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes, as numba asks for them."""
        passes: Any = _builder.define_nopython_pipeline(self.state)
        passes.add_pass_after(
            _UsePartLibrary, typed_passes.AnnotateTypes
        )  # the last one before the lowering
        passes.finalize()
        return [passes]


class LoopCompiler(PartCompiler):
    """The same for a part whose arrays do not overlap."""

    def define_pipelines(self) -> list[Any]:
        """Return the passes; numba marks the arguments, but has no option that asks for it."""
        self.state.flags.noalias = True
        return PartCompiler.define_pipelines(self)
