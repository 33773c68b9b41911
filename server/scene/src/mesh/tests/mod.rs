//! Mesh files as other programs write them: polygons of every shape, dialects, and what is told.

mod shapes;
mod polygons;
mod dialects;
mod told;
