//! Rays against single shapes, and which part of the shape they meet. The kernels are with the shapes (`shape::ray`).

use crate::shape::{MeshRayHit, Ray, Shape, ShapeHit, cast_ray};

/// Where a ray meets a shape, and which part of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PartHit {
    pub hit: ShapeHit,
    pub child: Option<u32>,
    pub triangle: Option<u32>,
}

impl PartHit {
    fn of_triangle(found: &MeshRayHit) -> Self {
        let hit = ShapeHit { fraction: found.distance, normal: found.normal };
        Self { hit, child: None, triangle: Some(found.triangle) }
    }
}

/// As [`cast_ray`], with the part.
#[inline]
pub(crate) fn find(shape: &Shape, ray: &Ray) -> Option<PartHit> {
    match shape {
        Shape::Mesh(mesh) => {
            mesh.cast_ray(ray.origin, ray.direction, ray.max_fraction).as_ref().map(PartHit::of_triangle)
        }
        Shape::HeightField(field) => {
            field.cast_ray(ray.origin, ray.direction, ray.max_fraction).as_ref().map(PartHit::of_triangle)
        }
        Shape::Compound(compound) => {
            compound.cast_ray(ray).map(|(child, hit)| PartHit { hit, child: Some(child as u32), triangle: None })
        }
        other => cast_ray(other, ray).map(|hit| PartHit { hit, child: None, triangle: None }),
    }
}
