"""What a picture needs around the distribution: Fresnel, masking, and the BRDF itself."""
