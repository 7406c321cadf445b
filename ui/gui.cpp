// gui.cpp - the bridge to Dear ImGui 1.86: the only file that knows it.
#include "ui/gui.h"
#include "ui/view_event.h"
#include <backends/imgui_impl_opengl3.h>
#include <cfloat>
#include <cstdio>
#include <imgui.h>
#include <unistd.h>

namespace
{
double scale = 1;
int more_frames; // Dear ImGui lays a new panel out in one frame and draws it in the next

void style()
{
    static const struct {
        int what;
        float r, g, b;
    } colors[] = {// clang-format off
        {ImGuiCol_WindowBg, .115f, .120f, .130f},       {ImGuiCol_PopupBg, .140f, .145f, .155f},
        {ImGuiCol_Text, .900f, .900f, .890f},           {ImGuiCol_TextDisabled, .600f, .610f, .620f},
        {ImGuiCol_FrameBg, .190f, .200f, .215f},        {ImGuiCol_FrameBgHovered, .240f, .255f, .270f},
        {ImGuiCol_FrameBgActive, .280f, .300f, .320f},  {ImGuiCol_TitleBg, .170f, .180f, .195f},
        {ImGuiCol_TitleBgActive, .170f, .180f, .195f},  {ImGuiCol_Header, .170f, .180f, .195f},
        {ImGuiCol_HeaderHovered, .220f, .235f, .250f},  {ImGuiCol_HeaderActive, .260f, .280f, .300f},
        {ImGuiCol_Button, .210f, .225f, .240f},         {ImGuiCol_ButtonHovered, .270f, .290f, .310f},
        {ImGuiCol_ButtonActive, .320f, .340f, .360f},   {ImGuiCol_CheckMark, .930f, .720f, .330f},
        {ImGuiCol_PlotHistogram, .930f, .720f, .330f},  {ImGuiCol_SliderGrabActive, .620f, .480f, .230f},
        {ImGuiCol_SliderGrab, .520f, .400f, .190f}}; // the value stands on it
    // clang-format on
    ImGui::StyleColorsDark();
    ImGuiStyle &s = ImGui::GetStyle();
    for (const auto &c : colors)
        s.Colors[c.what] = ImVec4(c.r, c.g, c.b, 1);
    s.FrameRounding = s.GrabRounding = s.PopupRounding = 3;
    s.WindowBorderSize = 0;
    s.WindowPadding = ImVec2(12, 10);
    s.FramePadding = ImVec2(7, 3);
    s.ItemSpacing = ImVec2(8, 5);
    s.GrabMinSize = 9;
    s.ScrollbarSize = 11;
    s.ScaleAllSizes((float)scale);
}

void key_map(ImGuiIO &io)
{
    static const struct {
        int gui, key;
    } keys[] = {{ImGuiKey_Tab, KEY_TAB},
                {ImGuiKey_LeftArrow, KEY_LEFT},
                {ImGuiKey_RightArrow, KEY_RIGHT},
                {ImGuiKey_UpArrow, KEY_UP},
                {ImGuiKey_DownArrow, KEY_DOWN},
                {ImGuiKey_Home, KEY_HOME},
                {ImGuiKey_End, KEY_END},
                {ImGuiKey_Delete, KEY_DELETE},
                {ImGuiKey_Backspace, KEY_BACKSPACE},
                {ImGuiKey_Enter, KEY_ENTER},
                {ImGuiKey_Escape, KEY_ESCAPE},
                {ImGuiKey_A, 'A'},
                {ImGuiKey_Z, 'Z'},
                {ImGuiKey_Y, 'Y'}};
    for (const auto &k : keys)
        io.KeyMap[k.gui] = k.key;
}

ImVec2 at(double x, double y)
{
    return ImVec2((float)x, (float)y);
}

ImDrawList *over()
{
    return ImGui::GetBackgroundDrawList();
}

// The label stands left of what it names, in a column of its own.
const char *labelled(const char *label)
{
    static char id[100];
    ImGui::AlignTextToFramePadding();
    ImGui::TextUnformatted(label);
    ImGui::SameLine((float)(118 * scale));
    ImGui::SetNextItemWidth(-FLT_MIN);
    snprintf(id, sizeof id, "##%s", label);
    return id;
}
} // namespace

extern "C" {

bool gui_open(double to_scale, const char *font)
{
    scale = to_scale;
    IMGUI_CHECKVERSION();
    ImGui::CreateContext();
    ImGuiIO &io = ImGui::GetIO();
    io.IniFilename = nullptr;
    io.ConfigInputTextCursorBlink = false; // a blinking cursor would draw an idle window
    key_map(io);
    static const ImWchar glyphs[] = {0x20,   0xff,   0x391,  0x3c9,  0x2007, 0x2044, 0x2070, 0x209c,
                                     0x2190, 0x2193, 0x2212, 0x2212, 0x221e, 0x221e, 0};
    const float height = (float)(15 * scale);
    if (font && !access(font, R_OK)) {
        io.Fonts->AddFontFromFileTTF(font, height, nullptr, glyphs);
    } else {
        ImFontConfig builtin;
        builtin.SizePixels = (float)(13 * scale);
        io.Fonts->AddFontDefault(&builtin);
    }
    style();
    return ImGui_ImplOpenGL3_Init("#version 330 core");
}

void gui_close(void)
{
    ImGui_ImplOpenGL3_Shutdown();
    ImGui::DestroyContext();
}

// clang-format off
void gui_mouse(double x, double y) { ImGui::GetIO().MousePos = at(x, y); }
void gui_button(int button, bool down) { ImGui::GetIO().MouseDown[button] = down; }
void gui_wheel(double steps) { ImGui::GetIO().MouseWheel += (float)steps; }
void gui_text_in(unsigned codepoint) { ImGui::GetIO().AddInputCharacter(codepoint); }
// clang-format on

void gui_key(int key, int mods, bool on)
{
    ImGuiIO &io = ImGui::GetIO();
    io.KeyCtrl = mods & MOD_CTRL;
    io.KeyShift = mods & MOD_SHIFT;
    io.KeyAlt = mods & MOD_ALT;
    if (key >= 0 && key < KEYS)
        io.KeysDown[key] = on;
}

// clang-format off
bool gui_wants_mouse(void) { return ImGui::GetIO().WantCaptureMouse; }
bool gui_wants_keys(void) { return ImGui::GetIO().WantTextInput; }
bool gui_is_held(void) { return ImGui::IsAnyItemActive(); }
bool gui_wants_frames(void) { return more_frames > 0; }
// clang-format on

void gui_begin(int w, int h, double seconds)
{
    ImGuiIO &io = ImGui::GetIO();
    io.DisplaySize = at(w, h);
    io.DeltaTime = seconds > 1e-6 ? (float)seconds : 1e-6f;
    more_frames -= more_frames > 0;
    ImGui_ImplOpenGL3_NewFrame();
    ImGui::NewFrame();
}

void gui_end(void)
{
    ImGui::Render();
    ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

bool gui_panel(const char *title, gui_rect place, bool plain)
{
    ImGui::SetNextWindowPos(at(place.x, place.y));
    ImGui::SetNextWindowSize(at(place.w, place.h));
    const bool open = ImGui::Begin(
        title, nullptr,
        ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoNav |
            ImGuiWindowFlags_NoBringToFrontOnFocus | (plain ? ImGuiWindowFlags_NoBackground : 0) |
            ImGuiWindowFlags_NoSavedSettings);
    if (ImGui::IsWindowAppearing())
        more_frames = 2;
    return open;
}

void gui_panel_end(void)
{
    ImGui::End();
}

void gui_popup(const char *title, double w, double h)
{
    const ImVec2 all = ImGui::GetIO().DisplaySize;
    ImGui::SetNextWindowPos(ImVec2(all.x / 2, all.y / 2), 0, ImVec2(0.5f, 0.5f));
    ImGui::SetNextWindowSize(at(w, h));
    ImGui::SetNextWindowFocus();
    ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, 1);
    ImGui::Begin(title, nullptr,
                 ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoCollapse |
                     ImGuiWindowFlags_NoSavedSettings);
    ImGui::PopStyleVar();
    if (ImGui::IsWindowAppearing())
        more_frames = 2;
}

bool gui_section(const char *title, bool open)
{
    ImGui::Spacing();
    return ImGui::CollapsingHeader(title, open ? ImGuiTreeNodeFlags_DefaultOpen : 0);
}

// clang-format off
double gui_line_height(void) { return ImGui::GetTextLineHeightWithSpacing(); }
void gui_text(const char *text) { ImGui::TextUnformatted(text); }
// clang-format on

void gui_note(const char *text)
{
    ImGui::PushStyleColor(ImGuiCol_Text, ImGui::GetStyleColorVec4(ImGuiCol_TextDisabled));
    ImGui::TextWrapped("%s", text);
    ImGui::PopStyleColor();
}

void gui_warn(const char *text)
{
    ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(1, 0.55f, 0.40f, 1));
    ImGui::TextWrapped("%s", text);
    ImGui::PopStyleColor();
}

void gui_fact(const char *name, const char *value)
{
    ImGui::TextDisabled("%s", name);
    ImGui::SameLine((float)(118 * scale));
    ImGui::TextWrapped("%s", value);
}

// clang-format off
void gui_space(void) { ImGui::Spacing(); }
void gui_beside(void) { ImGui::SameLine(); }
bool gui_press(const char *label) { return ImGui::Button(label); }
bool gui_check(const char *label, bool *on) { return ImGui::Checkbox(label, on); }
bool gui_pick(const char *label, bool chosen) { return ImGui::Selectable(label, chosen); }
// clang-format on

bool gui_choice(const char *label, const char *zero_separated, int *k)
{
    return ImGui::Combo(labelled(label), k, zero_separated);
}

bool gui_number(const char *label, double *v, double lo, double hi, const char *format, bool log)
{
    return ImGui::SliderScalar(labelled(label), ImGuiDataType_Double, v, &lo, &hi, format,
                               ImGuiSliderFlags_AlwaysClamp |
                                   (log ? ImGuiSliderFlags_Logarithmic : 0));
}

bool gui_whole(const char *label, int *v, int lo, int hi)
{
    return ImGui::SliderInt(labelled(label), v, lo, hi, "%d", ImGuiSliderFlags_AlwaysClamp);
}

void gui_curve(const float *y, int n, float top, double high)
{
    ImGui::PlotHistogram("##curve", y, n, 0, nullptr, 0, top,
                         ImVec2(ImGui::GetContentRegionAvail().x, (float)high));
}

void gui_hint(const char *text)
{
    if (ImGui::IsItemHovered())
        ImGui::SetTooltip("%s", text);
}

// clang-format off
void gui_clip(gui_rect r) { over()->PushClipRect(at(r.x, r.y), at(r.x + r.w, r.y + r.h)); }
void gui_unclip(void) { over()->PopClipRect(); }
// clang-format on

void gui_line(double x0, double y0, double x1, double y1, unsigned color, double width)
{
    over()->AddLine(at(x0, y0), at(x1, y1), color, (float)width);
}
void gui_circle(double x, double y, double radius, unsigned color, double width)
{
    over()->AddCircle(at(x, y), (float)radius, color, 0, (float)width);
}
void gui_fill(gui_rect r, unsigned color)
{
    over()->AddRectFilled(at(r.x, r.y), at(r.x + r.w, r.y + r.h), color);
}
void gui_say(double x, double y, unsigned color, const char *text)
{
    over()->AddText(at(x, y), color, text);
}
double gui_say_width(const char *text)
{
    return ImGui::CalcTextSize(text).x;
}
}
