"""The 2 Hz navigator: homes, kinematic environment, training; ``vinl.nav.gym`` registers it with gymnasium."""
