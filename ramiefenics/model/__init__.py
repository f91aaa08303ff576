"""The discrete model: mesh, kinematics, laws, contact, forms."""
