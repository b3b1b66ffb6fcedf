"""Read the files of strong-motion archives: identify the format, check the file, build records."""

from .catalogue import CATALOGUE as CATALOGUE
from .catalogue import CatalogueEntry as CatalogueEntry
from .catalogue import is_catalogue as is_catalogue
from .catalogue import read_catalogue as read_catalogue
from .catalogue import write_catalogue as write_catalogue
from .collection import collect as collect
from .collection import collect_sources as collect_sources
from .collection import sorted_out as sorted_out
from .containers import ARCHIVE_HEAD as ARCHIVE_HEAD
from .containers import contents as contents
from .containers import folder_names as folder_names
from .containers import is_archive as is_archive
from .containers import load as load
from .containers import printable as printable
from .files import Reading as Reading
from .files import Source as Source
from .files import read_file as read_file
from .files import sources_of as sources_of
from .options import ReadOptions as ReadOptions
from .options import TextLayout as TextLayout
from .registry import FORMATS as FORMATS
from .registry import Format as Format
from .registry import read_bytes as read_bytes
from .registry import sniff_format as sniff_format
