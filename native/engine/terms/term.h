// A term of a derivative, as both modes of the engine run it (engine/derivatives.cpp): one or two passes,
// each divided into chunks, which do not depend on the number of threads.
#pragma once

#include "engine/drop_count.h"
#include "engine/image_tasks.h"
#include "engine/workspace.h"
#include "scene/view.h"
#include "tasks/block_sizes.h"
#include "tasks/kernel_table.h"
#include "tasks/splats.h"

namespace edgegrad {

// The context of a chunk. Forward mode reads tangents and writes to the picture. Reverse mode reads the
// picture's adjoint and adds to gradients.
struct TermRun {
    const KernelTable& kernels;
    const SceneView& scene;
    ThreadMemory& memory;
    const DifferentiableTables& tables;  // with tangents or gradients
    DerivativeView view;                 // the same for boundary kernels
    const float* adjoint;                // null: forward mode
    float* image;                        // of forward mode, and
    Splats splats;                       // the chunk's, of terms that have splats

    bool is_forward() const { return !adjoint; }
    Workspace& work() const { return memory.paths(); }
};

class Term {
 public:
    Term(DerivativeTerm of, Part what) : name(of), part(what) {}
    virtual ~Term() = default;
    Term(const Term&) = delete;
    Term& operator=(const Term&) = delete;

    virtual int passes() const { return 1; }
    virtual int64_t samples(int pass) const = 0;
    virtual int64_t chunks(int pass) const = 0;
    // Whether forward mode computes splats for each sample, kBoundaryChunk of them per chunk. Otherwise each
    // chunk adds to its own pixels.
    virtual bool has_splats() const = 0;
    virtual int64_t splats(int pass) const { return samples(pass); }
    // Runs one chunk, in the mode of `run`.
    virtual void run(TermRun& run, int pass, int64_t chunk) = 0;
    // Called before and after a gradient from which later ones learn.
    virtual void record() {}
    virtual void teach() {}
    // Whether the first sample that was left out is reported by its pixel; otherwise by its edge, in this
    // view:
    virtual bool drops_by_pixel() const = 0;
    virtual SceneView view(const SceneView& scene) const { return scene; }

    const DroppedSamples& dropped() const { return dropped_.sum(); }
    int64_t all_samples() const {
        return sum([this](int pass) { return samples(pass); });
    }
    int64_t all_chunks() const {
        return sum([this](int pass) { return chunks(pass); });
    }

    const DerivativeTerm name;  // whose share of the samples it takes
    const Part part;            // the part that it computes; the first of several

 protected:
    // Counts samples that a chunk of a pass has left out.
    void drop(int pass, const DroppedSamples& lost) { dropped_.add(lost, pass == 0 ? 0 : samples(0)); }

 private:
    template <typename F>
    int64_t sum(const F& of_pass) const {
        int64_t all = 0;
        for (int pass = 0; pass < passes(); ++pass) all += of_pass(pass);
        return all;
    }

    DropCount dropped_;
};

struct TermPass {
    Term* term;
    int pass;
};

// A term whose samples lie along a list of segments.
class SampledTerm : public Term {
 public:
    using Term::Term;
    // Of forward mode; their number divides kBoundaryChunk.
    virtual int32_t splats_of_sample() const { return 1; }
    int64_t splats(int pass) const final { return splats_of_sample() * samples(pass); }
    int64_t chunks(int pass) const final { return (splats(pass) + kBoundaryChunk - 1) / kBoundaryChunk; }
    bool has_splats() const final { return true; }
    bool drops_by_pixel() const override { return false; }
    void run(TermRun& run, int pass, int64_t chunk) final {
        const int64_t most = kBoundaryChunk / splats_of_sample(), first = chunk * most;
        DroppedSamples lost;
        run_samples(run, pass, first, std::min(most, samples(pass) - first), lost);
        drop(pass, lost);
    }

 protected:
    // Runs samples [first, first + count) of a pass, whose splats are at most kBoundaryChunk.
    virtual void run_samples(TermRun& run, int pass, int64_t first, int64_t count, DroppedSamples& lost) = 0;
};

// A term whose samples are paths of the picture.
class PictureTerm : public Term {
 public:
    PictureTerm(DerivativeTerm of, Part what, ImagePlan of_paths)
        : Term(of, what), plan_(std::move(of_paths)) {}
    const ImagePlan& plan() const { return plan_; }
    int64_t samples(int) const final { return plan_.all_samples(); }
    int64_t chunks(int) const final { return plan_.chunks; }
    bool has_splats() const final { return false; }
    bool drops_by_pixel() const final { return true; }
    void run(TermRun& run, int pass, int64_t chunk) final {
        if (!run.is_forward() && !plan_.any_adjoint(chunk, run.adjoint)) return;
        plan_.for_each_task(chunk, [&](const ImageTask& task) {
            DroppedSamples lost;
            run_task(run, task, lost);
            drop(pass, lost);
            if (run.is_forward()) run.kernels.accumulate(task, run.work(), run.image);
        });
    }

 protected:
    // Runs a task: forward into the radiance of its paths, or in reverse from the adjoint of its pixels.
    virtual void run_task(TermRun& run, const ImageTask& task, DroppedSamples& lost) = 0;

    ImagePlan plan_;
};

}  // namespace edgegrad
