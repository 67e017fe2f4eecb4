// Where requested values change no shading, so that the interior term is zero.
#pragma once

#include <optional>
#include <vector>

#include "engine/decisions/decisions.h"
#include "engine/float_spans.h"
#include "scene/view.h"

namespace edgegrad {

// The rules, with the facts of the scene that they need. A fact is found at its first use: rules are asked
// about each of very many parameters. Not for several threads at once.
class ShadingRules {
 public:
    // Refers to the scene and the tables.
    ShadingRules(const SceneView& scene, const SceneTables& tables, int max_depth);

    // The reason why the requested values change no shading; kNeeded: they may change it.
    Reason constant(const FloatSpans& requested);

 private:
    // A fact that is found at its first use.
    template <typename Value, typename Find>
    static const Value& known(std::optional<Value>& fact, const Find& find) {
        if (!fact) fact = find();
        return *fact;
    }
    // What some values of all closures that are in use depend on.
    struct Sources {
        std::vector<FloatSpan> spans_of_all, spans_of_seen;
        FloatSpans all, seen;  // seen: those that change what the camera sees without any scattering
    };
    struct Materials {
        std::vector<uint8_t> black;  // by material: it scatters no light
        std::vector<uint8_t> stays;  // its surfaces look the same wherever they are
    };

    bool looks_the_same(const FloatSpans& requested) const;
    bool only_outlines_move(const FloatSpans& requested);
    bool surfaces_have_fixed_light();
    Reason constant_by_kind(const FloatSpans& requested);
    Reason constant_by_motion(const FloatSpans& requested);
    Reason constant_by_values(const FloatSpans& requested);
    Reason constant_by_lights(const FloatSpans& requested);
    const Materials& materials();
    Materials find_materials() const;
    Sources find_sources() const;

    const SceneView& scene_;
    const SceneTables& tables_;
    const int max_depth_;
    std::optional<Materials> materials_;
    std::optional<Sources> sources_;
    std::optional<bool> fixed_light_, all_black_;
    std::vector<int8_t> mesh_changes_;  // by mesh: it looks different elsewhere; -1: unknown
};

// Whether requested values move anything: vertices, instances, fields, the camera's rays, lights or the
// environment.
bool moves_anything(const SceneTables& tables, const FloatSpans& requested);

}  // namespace edgegrad
