#include "html.hpp"

#include <stdexcept>
#include <vector>

#include "trihedron/records/text.hpp"

namespace trihedron::report {
namespace {

using nlohmann::json;
using Scopes = std::vector<const json*>;

const json* find(const Scopes& scopes, const std::string& name) {
  if (name == ".") {
    return scopes.back();
  }
  for (auto scope = scopes.rbegin(); scope != scopes.rend(); ++scope) {
    if ((*scope)->is_object()) {
      if (const auto found = (*scope)->find(name); found != (*scope)->end()) {
        return &*found;
      }
    }
  }
  return nullptr;
}

bool says_yes(const json* value) {
  if (value == nullptr || value->is_null()) {
    return false;
  }
  if (value->is_boolean()) {
    return value->get<bool>();
  }
  return value->is_string() ? !value->get_ref<const std::string&>().empty() : !value->empty();
}

class Template {
 public:
  explicit Template(std::string_view text) : rest_(text) {}

  /// Up to the end of section `name`, or of the text. Nothing is put out where `out` is null.
  void fill(Scopes& scopes, const std::string& name, std::string* out) {
    while (true) {
      const std::size_t open = rest_.find("{{");
      append(out, rest_.substr(0, open));
      if (open == std::string_view::npos) {
        if (!name.empty()) {
          throw std::invalid_argument("section without end: " + name);
        }
        return;
      }
      rest_.remove_prefix(open);
      const bool raw = rest_.starts_with("{{{");
      const std::string_view closing = raw ? "}}}" : "}}";
      const std::size_t close = rest_.find(closing);
      if (close == std::string_view::npos) {
        throw std::invalid_argument("tag without end");
      }
      const std::string tag(rest_.substr(closing.size(), close - closing.size()));
      rest_.remove_prefix(close + closing.size());
      const std::string inner = tag.substr(std::min<std::size_t>(tag.find_first_not_of("#^/"), tag.size()));
      switch (tag.empty() ? '\0' : tag.front()) {
        case '/':
          if (inner != name) {
            throw std::invalid_argument("section " + name + " ends as " + inner);
          }
          return;
        case '#':
          fill_section(scopes, inner, find(scopes, inner), out);
          break;
        case '^':
          fill(scopes, inner, says_yes(find(scopes, inner)) ? nullptr : out);
          break;
        default:
          append(out, text_of(scopes, tag, raw, out != nullptr));
      }
    }
  }

 private:
  static void append(std::string* out, std::string_view text) {
    if (out != nullptr) {
      *out += text;
    }
  }

  static std::string text_of(const Scopes& scopes, const std::string& name, bool raw, bool needed) {
    if (!needed) {
      return {};
    }
    const json* value = find(scopes, name);
    if (value == nullptr) {
      throw std::invalid_argument("no such variable: " + name);
    }
    const std::string text = value->is_string() ? value->get<std::string>() : value->dump();
    return raw ? text : escaped(text);
  }

  void fill_section(Scopes& scopes, const std::string& name, const json* value, std::string* out) {
    if (out == nullptr || !says_yes(value)) {
      fill(scopes, name, nullptr);
      return;
    }
    const std::string_view body = rest_;
    const auto once = [&](const json& scope) {
      rest_ = body;
      scopes.push_back(&scope);
      fill(scopes, name, out);
      scopes.pop_back();
    };
    if (!value->is_array()) {
      once(*value);
      return;
    }
    for (const json& element : *value) {
      once(element);
    }
  }

  std::string_view rest_;
};

}  // namespace

std::string escaped(std::string_view text) {
  // Names from telemetry may be no UTF-8, or hold marks that turn the direction of writing.
  const std::string shown = printable_lines(text);
  std::string out;
  out.reserve(shown.size());
  for (const char c : shown) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string script_safe(const json& data) {
  // A name from telemetry may be no UTF-8.
  const std::string text = data.dump(-1, ' ', false, json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    c == '<' ? out += "\\u003c" : out += c;
  }
  return out;
}

std::string fill_in(std::string_view page, const json& values) {
  std::string out;
  Scopes scopes{&values};
  Template(page).fill(scopes, "", &out);
  return out;
}

}  // namespace trihedron::report
