//! Cages made from the model.

mod subdivided_box;

pub use subdivided_box::subdivided_box;
