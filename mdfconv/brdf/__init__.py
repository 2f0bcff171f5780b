"""What a picture needs around the distribution: Fresnel, masking, and the BRDF itself."""

from mdfconv.brdf.fresnel import conductor, dielectric
from mdfconv.brdf.microfacet import MASKINGS, Microsurface
from mdfconv.brdf.reflection import BRDFS, NORMALIZERS

__all__ = ["BRDFS", "MASKINGS", "NORMALIZERS", "Microsurface", "conductor", "dielectric"]
