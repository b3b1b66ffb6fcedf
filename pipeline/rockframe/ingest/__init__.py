"""Read the files of strong-motion archives: identify the format, check the file, build records."""

from rockframe.engines.pool import Limits as Limits
from rockframe.ingest.catalogue import CATALOGUE as CATALOGUE
from rockframe.ingest.catalogue import CatalogueEntry as CatalogueEntry
from rockframe.ingest.catalogue import read_catalogue as read_catalogue
from rockframe.ingest.catalogue import with_facts as with_facts
from rockframe.ingest.catalogue import write_catalogue as write_catalogue
from rockframe.ingest.collection import collect as collect
from rockframe.ingest.collection import collect_sources as collect_sources
from rockframe.ingest.collection import sorted_out as sorted_out
from rockframe.ingest.containers import ARCHIVE_HEAD as ARCHIVE_HEAD
from rockframe.ingest.containers import contents as contents
from rockframe.ingest.containers import is_archive as is_archive
from rockframe.ingest.files import Rejection as Rejection
from rockframe.ingest.files import Unread as Unread
from rockframe.ingest.files import load as load
from rockframe.ingest.files import read_file as read_file
from rockframe.ingest.members import printable as printable
from rockframe.ingest.options import ReadOptions as ReadOptions
from rockframe.ingest.registry import FORMATS as FORMATS
from rockframe.ingest.registry import Format as Format
from rockframe.ingest.registry import read_bytes as read_bytes
from rockframe.ingest.registry import sniff_format as sniff_format
from rockframe.ingest.sources import Source as Source
from rockframe.ingest.sources import folder_names as folder_names
from rockframe.ingest.sources import is_catalogue as is_catalogue
from rockframe.ingest.sources import sources_of as sources_of
