"""From strong-motion records to the rocking response of free-standing frames.

``__init__.pyi`` lists the public names. Each is imported when it is first used, so that
`rockframe --help` does not wait for the scientific packages.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
