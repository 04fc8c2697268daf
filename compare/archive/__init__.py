"""Archives of studies, and their verification on any machine."""

from compare.archive.pack import pack_study
from compare.archive.unpack import unpack_archive
from compare.archive.verify import Finding, Verification, verify_archive, verify_folder

__all__ = ["Finding", "Verification", "pack_study", "unpack_archive", "verify_archive", "verify_folder"]
