"""Wheels of equal sectors with contact: modes by nodal diameters, whole wheels, mistuning."""
