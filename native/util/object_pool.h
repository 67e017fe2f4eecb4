// Objects that calls pass on to later calls, together with their memory: every first access to a page of
// newly allocated memory is a page fault.
#pragma once

#include <memory>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

namespace edgegrad {

template <typename T>
class ObjectPool {
 public:
    // Takes an object that a call has given back, in the state it was left in, or makes one.
    std::shared_ptr<T> take() {
        {
            const std::lock_guard<std::mutex> lock(lock_);
            if (!values_.empty()) {
                std::shared_ptr<T> value = std::move(values_.back());
                values_.pop_back();
                return value;
            }
        }
        return std::make_shared<T>();
    }
    // Gives an object back, unless it is still shared or there is no memory to store it.
    void give(std::shared_ptr<T> value) noexcept {
        if (value.use_count() != 1) return;
        const std::lock_guard<std::mutex> lock(lock_);
        try {
            values_.push_back(std::move(value));
        } catch (const std::bad_alloc&) {
        }
    }

 private:
    std::mutex lock_;
    std::vector<std::shared_ptr<T>> values_;  // at most as many as were in use at once
};

}  // namespace edgegrad
