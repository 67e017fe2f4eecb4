// Cycles' Filter Glossy: microfacet lobes are at least so wide where paths reach them by diffuse bounces.
//
// Cycles bounds alpha from below by sqrt(1 - p / g) / 2, where p is the least density of a path's scattering
// events so far, and g the setting. Here a diffuse bounce has the mean of that bound over the cosine
// distribution p = c / pi, and other bounces have none. So the bound is a constant of the scene, and a path's
// lobes have no derivative by the densities of its earlier bounces.
#pragma once

#include "shading/bsdf/closures.h"
#include "shading/bsdf/shaders.h"
#include "texture/point.h"

namespace edgegrad::EDGEGRAD_ISA {

// Paths with a diffuse bounce. The diffuse count is the lowest byte (path/path_queue.h).
EG_INLINE Mask is_behind_diffuse(const RayHistory& history) {
    return (history.bounces != -1) & ((history.bounces & 255) > 0);
}

EG_INLINE void widen(Microfacets& g, Mask m, Float least, Vec3 view) {
    const Mask narrow = m & ((g.ax < least) | (g.ay < least));
    if (!any(narrow)) return;
    Microfacets wide = make_facets(max(g.ax, least), max(g.ay, least), view);
    if (g.others) set_other_distribution(wide, g.beckmann, g.phong, view);
    g = select_facets(narrow, wide, g);
}

// Widens the lobes of the mask's lanes. As in Cycles, their weights are those of the lobes before.
EG_INLINE void filter_glossy(Bsdf& f, Mask m, Float least) {
    if (f.any_lobe[kMirrorLobe]) widen(f.mirror.facets, m, least, f.turned_view);
    if (f.any_lobe[kCoatLobe]) widen(f.coat.facets, m, least, f.view);
    if (f.any_lobe[kInterfaceLobe]) widen(f.glass.facets, m, least, f.view);
}

}  // namespace edgegrad::EDGEGRAD_ISA
