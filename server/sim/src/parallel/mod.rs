//! How work is divided.
