"""From strong-motion records to the rocking response of free-standing frames.

The public names are listed in the stub beside this file; each is imported when it is first used,
so that `rockframe --help` does not wait for the scientific stack.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
