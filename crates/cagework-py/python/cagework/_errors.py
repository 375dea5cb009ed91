"""Exceptions of cagework. A missing file is an OSError, and Ctrl-C a KeyboardInterrupt."""


class Error(Exception):
    """Base class of all exceptions of cagework."""


class ArrayError(Error, ValueError):
    """An array with an unexpected type or shape; the message names the actual and the expected ones."""


class OptionError(Error, ValueError):
    """An option with an invalid value."""


class CageError(Error, ValueError):
    """A mesh that is not a valid cage, or a failed cage generation."""


class BindError(Error):
    """A failed bind: no point is inside the cage, or the memory limit is exceeded."""


class ModelError(Error):
    """A file that cannot be read as a model, or a model that cannot be written."""


class PullError(Error):
    """Invalid grabs, pins or targets of a pull."""
