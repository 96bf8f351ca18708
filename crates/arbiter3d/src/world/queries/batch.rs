//! Many rays or casts in one call, on several threads.
//!
//! Queries only read the world, so each thread takes pieces of the list until none is left and writes the answers where
//! they belong: they are the same, in the same order, for any number of threads. The threads are started for the call:
//! the pool of the step belongs to whoever steps the world, and a start costs less than the queries of one piece.

use super::rays::checked_ray;
use super::{CastHit, QueryFilter, RayHit, casts::checked_cast};
use crate::error::Error;
use crate::query::ShapeCast;
use crate::shape::Ray;
use crate::world::World;
use std::sync::{Mutex, PoisonError};

/// Rays in a piece: some tens of microseconds.
const RAYS: usize = 128;
/// Casts in a piece.
const CASTS: usize = 32;

impl World {
    /// The first hit of each ray, as [`World::cast_ray`] gives it, computed on
    /// [`threads`](crate::WorldSettings::threads) threads.
    ///
    /// ```
    /// use arbiter3d::{BodyId, QueryFilter, Ray, Shape, ShapeDefinition, World, math::Vec3};
    /// let mut world = World::default();
    /// world.add_shape(BodyId::WORLD, &ShapeDefinition::new(Shape::sphere(1.0)?))?;
    /// let rays: Vec<Ray> = (0..1000).map(|k| Ray::new(Vec3::new(k as f32 * 0.01, 5.0, 0.0), Vec3::Y * -10.0)).collect();
    /// let hits = world.cast_rays(&rays, &QueryFilter::default())?;
    /// assert!(hits[0].is_some() && hits[99].is_some() && hits[101].is_none());
    /// # Ok::<(), arbiter3d::Error>(())
    /// ```
    ///
    /// # Errors
    /// As [`World::cast_ray`], of the first ray that is wrong; then none is cast.
    pub fn cast_rays(&self, rays: &[Ray], filter: &QueryFilter<'_>) -> Result<Vec<Option<RayHit>>, Error> {
        let mut hits = Vec::new();
        self.cast_rays_into(rays, filter, &mut hits)?;
        Ok(hits)
    }

    /// As [`World::cast_rays`] into a list of your own, which is overwritten: no allocation once it is large enough,
    /// but for the threads.
    ///
    /// # Errors
    /// As [`World::cast_rays`].
    pub fn cast_rays_into(
        &self,
        rays: &[Ray],
        filter: &QueryFilter<'_>,
        hits: &mut Vec<Option<RayHit>>,
    ) -> Result<(), Error> {
        rays.iter().try_for_each(|ray| checked_ray(ray).map(drop))?;
        self.answer(rays, RAYS, hits, |ray| self.first_on(ray, filter));
        Ok(())
    }

    /// The first hit of each moving shape, as [`World::cast_shape`] gives it, computed on
    /// [`threads`](crate::WorldSettings::threads) threads.
    ///
    /// # Errors
    /// As [`World::cast_shape`], of the first cast that is wrong; then none is carried out.
    pub fn cast_shapes(
        &self,
        casts: &[ShapeCast<'_>],
        filter: &QueryFilter<'_>,
    ) -> Result<Vec<Option<CastHit>>, Error> {
        let casts: Vec<ShapeCast<'_>> = casts.iter().map(checked_cast).collect::<Result<_, _>>()?;
        let mut hits = Vec::new();
        self.answer(&casts, CASTS, &mut hits, |cast| self.first_touched(cast, filter));
        Ok(hits)
    }

    /// Answers all questions, in pieces, on as many threads as the world has.
    fn answer<Q: Sync, A: Copy + Send>(
        &self,
        questions: &[Q],
        piece: usize,
        answers: &mut Vec<Option<A>>,
        ask: impl Fn(&Q) -> Option<A> + Sync,
    ) {
        answers.clear();
        answers.resize(questions.len(), None);
        let threads = self.settings.threads.min(questions.len().div_ceil(piece));
        let pieces = Mutex::new(questions.chunks(piece).zip(answers.chunks_mut(piece)));
        let work = || {
            loop {
                let next = pieces.lock().unwrap_or_else(PoisonError::into_inner).next();
                let Some((questions, answers)) = next else { return };
                for (question, answer) in questions.iter().zip(answers) {
                    *answer = ask(question);
                }
            }
        };
        std::thread::scope(|scope| {
            for _ in 1..threads {
                // A thread that the system refuses is done without.
                drop(std::thread::Builder::new().spawn_scoped(scope, work));
            }
            work();
        });
    }
}
