// libcamera_bridge.cpp - the C++ half of "libcamera:"; requests complete on libcamera's own thread
// and wait here behind an eventfd.
#include "acquire/libcamera_bridge.h"
#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <libcamera/libcamera.h>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <vector>

namespace lc = libcamera;

struct lc_bridge {
    std::shared_ptr<lc::CameraManager> manager;
    std::shared_ptr<lc::Camera> camera;
    std::unique_ptr<lc::CameraConfiguration> config;
    std::unique_ptr<lc::FrameBufferAllocator> buffers;
    std::vector<std::unique_ptr<lc::Request>> requests;
    std::map<const lc::FrameBuffer *, lc::Span<uint8_t>>
        mapped; // first plane, from its file's start
    std::vector<lc::Request *> idle;
    std::map<const lc::Request *, uint64_t> shot; // that a request was made for
    bool started = false;
    int fd = -1;

    std::mutex mutex; // guards what follows
    std::deque<lc::Request *> done;
    bool gone = false;

    void completed(lc::Request *r)
    {
        const std::lock_guard<std::mutex> lock(mutex);
        done.push_back(r);
        eventfd_write(fd, 1);
    }
    void disconnected()
    {
        const std::lock_guard<std::mutex> lock(mutex);
        gone = true;
        eventfd_write(fd, 1);
    }
};

// A process may have one manager only.
static std::shared_ptr<lc::CameraManager> the_manager()
{
    static std::mutex mutex;
    static std::weak_ptr<lc::CameraManager> known;
    const std::lock_guard<std::mutex> lock(mutex);
    std::shared_ptr<lc::CameraManager> m = known.lock();
    if (m)
        return m;
    setenv("LIBCAMERA_LOG_LEVELS", "*:FATAL", false); // errors are told by those who call
    m = std::make_shared<lc::CameraManager>();
    known = m;
    return m->start() ? nullptr : m;
}

static std::string model_of(const lc::Camera &c)
{
    const auto model = c.properties().get(lc::properties::Model);
    return model ? std::string(*model) : c.id();
}

static bool choose_camera(lc_bridge *b, const char *name, err *e)
{
    b->manager = the_manager();
    if (!b->manager)
        return err_set(e, ERR_DEVICE, "libcamera does not start");
    const auto all = b->manager->cameras();
    for (size_t k = 0; k < all.size(); k++)
        if (all[k]->id() == name || std::to_string(k) == name)
            b->camera = all[k];
    if (!b->camera)
        return err_set(e, ERR_DEVICE, "camera %s is not there; there are %zu", name, all.size());
    if (!b->camera->acquire())
        return true;
    b->camera.reset();
    return err_set(e, ERR_DEVICE, "camera %s: another program uses it", name);
}

static const pixel_format *choose_format(lc::StreamConfiguration &c, const char *name)
{
    const auto offered = c.formats().pixelformats();
    const pixel_format *f, *asked = strcmp(name, "auto") ? pixel_format_named(name) : nullptr;
    for (int rank = 0; (f = pixel_format_at(rank)); rank++) {
        const auto at = std::find_if(offered.begin(), offered.end(), [f](const lc::PixelFormat &p) {
            return p.toString() == f->name;
        });
        if (at == offered.end() || (strcmp(name, "auto") && f != asked))
            continue;
        c.pixelFormat = *at;
        break;
    }
    return f;
}

static bool configure(lc_bridge *b, const char *format, int w, int h, lc_stream *s, err *e)
{
    b->config = b->camera->generateConfiguration({lc::StreamRole::Raw});
    if (!b->config || b->config->empty())
        b->config = b->camera->generateConfiguration({lc::StreamRole::Viewfinder});
    if (!b->config || b->config->empty())
        return err_set(e, ERR_DEVICE, "has no stream");
    lc::StreamConfiguration &c = b->config->at(0);
    if (!(s->pixels = choose_format(c, format)))
        return err_set(e, ERR_DATA, "format=%s: the camera has none such", format);
    c.size = {w ? unsigned(w) : c.size.width, h ? unsigned(h) : c.size.height};
    const lc::Size asked = c.size;
    if (b->config->validate() == lc::CameraConfiguration::Invalid ||
        c.pixelFormat.toString() != s->pixels->name)
        return err_set(e, ERR_DEVICE, "cannot stream %s", s->pixels->name);
    if ((w || h) && c.size != asked)
        return err_set(e, ERR_DATA, "w=%u,h=%u: the nearest there is is %u x %u", asked.width,
                       asked.height, c.size.width, c.size.height);
    if (!pixel_width_ok(s->pixels, int(c.size.width)))
        return err_set(e, ERR_DEVICE, "%u pixels do not fit %s", c.size.width, s->pixels->name);
    if (b->camera->configure(b->config.get()))
        return err_set(e, ERR_DEVICE, "cannot be configured");
    s->w = int(c.size.width);
    s->h = int(c.size.height);
    s->stride = c.stride;
    return true;
}

template <typename T> static void range(const lc_bridge *b, const lc::ControlId &id, T *lo, T *hi)
{
    const auto &all = b->camera->controls();
    const auto c = all.find(&id);
    if (c == all.end())
        return;
    *lo = c->second.min().get<std::conditional_t<std::is_floating_point_v<T>, float, int32_t>>();
    *hi = c->second.max().get<std::conditional_t<std::is_floating_point_v<T>, float, int32_t>>();
}

static bool start(lc_bridge *b, err *e)
{
    lc::Stream *stream = b->config->at(0).stream();
    b->buffers = std::make_unique<lc::FrameBufferAllocator>(b->camera);
    if (b->buffers->allocate(stream) < 0)
        return err_set(e, ERR_DEVICE, "no buffers");
    for (const std::unique_ptr<lc::FrameBuffer> &f : b->buffers->buffers(stream)) {
        const lc::FrameBuffer::Plane &p = f->planes()[0];
        const size_t bytes = p.offset + p.length;
        void *at = mmap(nullptr, bytes, PROT_READ, MAP_SHARED, p.fd.get(), 0);
        if (at == MAP_FAILED)
            return err_errno(e, "mmap");
        b->mapped[f.get()] = {static_cast<uint8_t *>(at), bytes};
        b->requests.push_back(b->camera->createRequest());
        if (!b->requests.back() || b->requests.back()->addBuffer(stream, f.get()))
            return err_set(e, ERR_DEVICE, "a buffer cannot be used");
        b->idle.push_back(b->requests.back().get());
    }
    b->camera->requestCompleted.connect(b, &lc_bridge::completed);
    b->camera->disconnected.connect(b, &lc_bridge::disconnected);
    b->started = !b->camera->start();
    return b->started || err_set(e, ERR_DEVICE, "does not start");
}

bool lc_open(lc_bridge **out, const char *name, const char *format, int w, int h, int *fd,
             lc_stream *s, err *e)
try {
    lc_bridge *b = *out = new lc_bridge;
    *s = {};
    b->fd = *fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (b->fd < 0)
        return err_errno(e, "eventfd");
    if (!choose_camera(b, name, e) || !configure(b, format, w, h, s, e))
        return false;
    snprintf(s->model, sizeof s->model, "%s", model_of(*b->camera).c_str());
    snprintf(s->id, sizeof s->id, "%s", b->camera->id().c_str());
    range(b, lc::controls::ExposureTime, &s->exposure_min_us, &s->exposure_max_us);
    range(b, lc::controls::AnalogueGain, &s->gain_min, &s->gain_max);
    range(b, lc::controls::LensPosition, &s->focus_min_per_m, &s->focus_max_per_m);
    if (!start(b, e))
        return false;
    s->requests = int(b->requests.size());
    return true;
} catch (const std::exception &x) {
    return err_set(e, ERR_DEVICE, "%s", x.what());
}

void lc_close(lc_bridge *b)
{
    if (b && b->camera) {
        if (b->started)
            b->camera->stop();
        b->camera->requestCompleted.disconnect();
        b->camera->disconnected.disconnect();
        b->requests.clear();
        for (const auto &[buffer, bytes] : b->mapped)
            munmap(bytes.data(), bytes.size());
        b->buffers.reset();
        b->camera->release();
        b->camera.reset();
    }
    delete b;
}

bool lc_request(lc_bridge *b, const lc_ask *ask, err *e)
{
    if (b->idle.empty())
        return err_set(e, ERR_DEVICE, "busy: all buffers are under way");
    lc::Request *r = b->idle.back();
    b->idle.pop_back();
    r->reuse(lc::Request::ReuseBuffers);
    b->shot[r] = ask->shot;
    const auto set = [&](const auto &id, const auto &value) {
        if (b->camera->controls().count(&id))
            r->controls().set(id, value);
    };
    set(lc::controls::AeEnable, false);
    set(lc::controls::AwbEnable, false);
#if LIBCAMERA_VERSION_MAJOR > 0 || LIBCAMERA_VERSION_MINOR >= 5
    set(lc::controls::ExposureTimeMode, lc::controls::ExposureTimeModeManual);
    set(lc::controls::AnalogueGainMode, lc::controls::AnalogueGainModeManual);
#endif
    set(lc::controls::ExposureTime, int32_t(ask->exposure_us));
    set(lc::controls::AnalogueGain, float(ask->gain));
    const std::array<int64_t, 2> interval = {ask->interval_us, ask->interval_us};
    if (ask->interval_us)
        set(lc::controls::FrameDurationLimits, lc::Span<const int64_t, 2>(interval));
    if (!std::isnan(ask->focus_per_m)) {
        set(lc::controls::AfMode, int32_t(lc::controls::AfModeManual));
        set(lc::controls::LensPosition, float(ask->focus_per_m));
    }
    return !b->camera->queueRequest(r) || err_set(e, ERR_DEVICE, "takes no request (unplugged?)");
}

template <typename T> static T said(lc::Request *r, const lc::Control<T> &id, T otherwise)
{
    return r->metadata().contains(id.id()) ? T(*r->metadata().get(id)) : otherwise;
}

bool lc_next(lc_bridge *b, lc_frame *f, bool *any, err *e)
{
    lc::Request *r = nullptr;
    {
        const std::lock_guard<std::mutex> lock(b->mutex);
        eventfd_t ignored;
        eventfd_read(b->fd, &ignored);
        if (b->gone)
            return err_set(e, ERR_DEVICE, "it is gone (unplugged?)");
        *any = !b->done.empty();
        if (!*any)
            return true;
        r = b->done.front();
        b->done.pop_front();
    }
    const lc::FrameBuffer *buffer = r->buffers().begin()->second;
    const lc::FrameMetadata &m = buffer->metadata();
    const size_t offset = buffer->planes()[0].offset;
    b->idle.push_back(r);
    *f = {b->shot[r],
          m.sequence,
          said(r, lc::controls::SensorTimestamp, int64_t(m.timestamp)),
          said(r, lc::controls::ExposureTime, 0),
          said(r, lc::controls::AnalogueGain, NAN),
          said(r, lc::controls::LensPosition, NAN),
          273.15 + double(said(r, lc::controls::SensorTemperature, NAN)),
          r->status() != lc::Request::RequestComplete ||
              m.status != lc::FrameMetadata::FrameSuccess,
          b->mapped[buffer].data() + offset,
          m.planes()[0].bytesused};
    return true;
}

void lc_find(found_fn *found, void *ctx)
{
    const auto manager = the_manager();
    const auto all = manager ? manager->cameras() : std::vector<std::shared_ptr<lc::Camera>>();
    for (size_t k = 0; k < all.size(); k++) {
        const std::string uri = "libcamera:" + std::to_string(k),
                          what = model_of(*all[k]) + " (" + all[k]->id() + ")";
        const struct found f = {uri.c_str(), what.c_str(), nullptr};
        found(ctx, &f);
    }
}
